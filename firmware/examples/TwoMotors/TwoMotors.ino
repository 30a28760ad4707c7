// Two DC motors with quadrature encoders on an Arduino Uno. Motors: PWM on D5 and D6, direction on D8 and D12; give D5 and
// D6 resistors of 10 kOhm to ground, which keep the motors off during a reset. Encoders: A on D2 and D3, B on D4 and D7.
// check_rig.py --push pushes each axis by itself and sees plugs that are swapped.
#include <haptic_device.h>
#include <avr/wdt.h>

const uint32_t FULL_MN = 8000;             // force at full duty: measure it with a spring scale
const float COUNTS_PER_METRE = 30000;      // two counts a line: move the handle along a ruler

haptic_device device;
haptic_device_config config;
volatile int32_t counts[2];
volatile uint32_t ticks_ms;
volatile bool ticked;

// The hardware watchdog stays on through the reset that it makes.
void stopWatchdog() __attribute__((naked, used, section(".init3")));
void stopWatchdog() { MCUSR = 0; wdt_disable(); }

// At each edge of A, B tells the direction.
void turned0() { if (!(PIND & 1 << 2) != !(PIND & 1 << 4)) counts[0]++; else counts[0]--; }
void turned1() { if (!(PIND & 1 << 3) != !(PIND & 1 << 7)) counts[1]++; else counts[1]--; }

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
  noInterrupts();
  sample->count[0] = counts[0];
  sample->count[1] = counts[1];
  interrupts();
}

// The pins leave the timer, and are low.
void motorOff(void *) { TCCR0A = 3; PORTD &= ~(1 << 5); PORTD &= ~(1 << 6); }
uint8_t dutyOf(int32_t force_mn) { return (uint32_t)labs(force_mn) * 255 / FULL_MN; }
void motorForce(void *, const int32_t force_mn[]) {
  uint8_t duty0 = dutyOf(force_mn[0]), duty1 = dutyOf(force_mn[1]);
  motorOff(nullptr);
  if (force_mn[0] > 0) PORTB |= 1; else PORTB &= ~1;
  if (force_mn[1] > 0) PORTB |= 1 << 4; else PORTB &= ~(1 << 4);
  OCR0B = duty0;
  OCR0A = duty1;
  TCCR0A = 3 | (duty0 ? 1 << COM0B1 : 0) | (duty1 ? 1 << COM0A1 : 0);
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
  pinMode(5, OUTPUT); pinMode(6, OUTPUT); pinMode(8, OUTPUT); pinMode(12, OUTPUT);
  for (uint8_t pin = 2; pin <= 7; pin++) if (pin != 5 && pin != 6) pinMode(pin, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(2), turned0, CHANGE);
  attachInterrupt(digitalPinToInterrupt(3), turned1, CHANGE);
  Serial.begin(1000000);
  TCCR0B = 1; TIMSK0 = 0;
  config.name = "two-motors 0.2"; config.axes = 2; config.sample_rate_hz = 500;
  for (uint8_t axis = 0; axis < 2; axis++) {
    config.counts_per_metre[axis] = COUNTS_PER_METRE;
    config.force_limit_mn[axis] = 5000;
  }
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
