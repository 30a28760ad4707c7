// A Hapkit (Arduino Uno): motor on D5 and D8, magneto-resistive sensor on A2. Give D5 a resistor of 10 kOhm to ground: it
// keeps the motor off during a reset. ports/avr is the same board without Arduino, with half of the delay.
#include <haptic_device.h>
#include <avr/wdt.h>

const uint32_t FULL_MN = 6300;             // force on the hand at full duty; it grows with the square of the duty
const int LOW_END = 51, HIGH_END = 972;    // readings of the sensor at the ends of half a turn of the motor
const int RANGE = HIGH_END - LOW_END + 1;

haptic_device device;
haptic_device_config config;
volatile uint32_t ticks_ms;
volatile bool ticked;

// The hardware watchdog stays on through the reset that it makes.
void stopWatchdog() __attribute__((naked, used, section(".init3")));
void stopWatchdog() { MCUSR = 0; wdt_disable(); }

// Timer 0 makes PWM of 62.5 kHz; its interrupt behind micros() and delay() would take a third of the processor. Timer 1
// keeps the time.
ISR(TIMER1_COMPA_vect) {
  ticks_ms++;
  ticked = true;
  haptic_device_watchdog_from_isr(&device, 1000);
}
uint32_t clockUs(void *) {
  noInterrupts();
  uint32_t ms = ticks_ms;
  uint16_t halves = TCNT1;
  if ((TIFR1 & 1 << OCF1A) && halves < 1000) ms++;    // it has begun again, and its interrupt waits
  interrupts();
  return ms * 1000 + halves / 2;
}

void measure(void *, haptic_sample *sample) {
  static int last = -1;
  static int32_t count;
  int reading, step, tries = 3;
  do {                                     // a reading during the flip between two half turns is neither
    reading = analogRead(A2);
    if (last < 0) last = reading;
    step = reading - last;
    if (step > RANGE / 2) step -= RANGE;
    if (step < -RANGE / 2) step += RANGE;
  } while (abs(step) > RANGE / 4 && --tries);
  last = reading;
  sample->count[0] = count += step;
  sample->lost = abs(step) > RANGE / 4 || reading < 20 || reading > 1003;    // too fast, or a wire is off
}

void motorOff(void *) { TCCR0A = 3; PORTD &= ~(1 << 5); }
void motorForce(void *, const int32_t force_mn[]) {
  uint16_t square = (uint32_t)labs(force_mn[0]) * 65025 / FULL_MN;
  uint8_t duty = 0;
  for (uint8_t bit = 128; bit; bit >>= 1)
    if ((uint16_t)(duty + bit) * (duty + bit) <= square) duty += bit;
  motorOff(nullptr);
  if (force_mn[0] > 0) PORTB |= 1; else PORTB &= ~1;
  if (duty) { OCR0B = duty; TCCR0A = 0x23; }
}

uint8_t readLine(void *, uint8_t *bytes, uint8_t room) {
  uint8_t length = 0;
  while (length < room && Serial.available()) bytes[length++] = Serial.read();
  return length;
}
bool writeLine(void *, const uint8_t *bytes, uint8_t length) {
  return Serial.availableForWrite() >= length && Serial.write(bytes, length) == length;
}

void setup() {
  motorOff(nullptr);
  pinMode(5, OUTPUT); pinMode(8, OUTPUT);
  Serial.begin(1000000);
  ADCSRA = (ADCSRA & ~7) | 5;              // a reading in 26 us
  TCCR0B = 1; TIMSK0 = 0;
  config.name = "hapkit-arduino 0.2"; config.axes = 1; config.sample_rate_hz = 1000;
  config.counts_per_metre[0] = 62050; config.force_limit_mn[0] = 5000;
  config.clock_us = clockUs; config.measure = measure; config.motor_force = motorForce; config.motor_off = motorOff;
  config.read = readLine; config.write = writeLine;
  haptic_device_init(&device, &config);
  TCCR1A = 0; TCCR1B = 1 << WGM12 | 1 << CS11; OCR1A = 1999; TIMSK1 = 1 << OCIE1A;
  wdt_enable(WDTO_30MS);
}

void loop() {
  haptic_device_poll(&device);
  if (ticked) { ticked = false; wdt_reset(); }
}
