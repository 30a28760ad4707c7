// A brushless motor under SimpleFOC (Arduino Uno, SimpleFOCShield), its torque commanded by hapticd instead of the
// Commander. Encoder and wiring are those of SimpleFOC's own examples; the driver's enable pin, D8, needs a resistor of
// 10 kOhm to ground. The motor is aligned at power-on, and moves.
#include <SimpleFOC.h>
#include <haptic_device.h>
#include <avr/wdt.h>

const float RADIUS_M = 0.03;               // of pulley or knob: force = torque / radius
const float NM_PER_VOLT = 0.02;            // torque of the motor to a volt of q: measure it with a spring scale
const int LINES = 2048;                    // of the encoder; four counts each

BLDCMotor motor = BLDCMotor(7);
BLDCDriver3PWM driver = BLDCDriver3PWM(9, 10, 11, 8);
Encoder encoder = Encoder(2, 3, LINES);
void doA() { encoder.handleA(); }
void doB() { encoder.handleB(); }

haptic_device device;
haptic_device_config config;
volatile float target_v;
volatile bool ticked;

// The hardware watchdog stays on through the reset that it makes.
void stopWatchdog() __attribute__((naked, used, section(".init3")));
void stopWatchdog() { MCUSR = 0; wdt_disable(); }

// Beside the interrupt behind micros(), every 1024 us. On another board take a timer of its own: IntervalTimer,
// HardwareTimer, hw_timer_t, add_repeating_timer_us; and its hardware watchdog.
ISR(TIMER0_COMPA_vect) {
  ticked = true;
  haptic_device_watchdog_from_isr(&device, 1024);
}

uint32_t clockUs(void *) { return micros(); }
void measure(void *, haptic_sample *sample) {
  encoder.update();
  sample->count[0] = encoder.getFullRotations() * 4L * LINES + lroundf(encoder.getMechanicalAngle() / _2PI * 4 * LINES);
}

// Pin 8 is the driver's enable.
void motorOff(void *) { target_v = 0; PORTB &= ~1; }
bool motorOn(void *) {
  target_v = 0;
  if (motor.motor_status != FOCMotorStatus::motor_ready) return false;
  PORTB |= 1;
  return true;
}
void motorForce(void *, const int32_t force_mn[]) { target_v = force_mn[0] * 0.001f * RADIUS_M / NM_PER_VOLT; }

uint8_t readLine(void *, uint8_t *bytes, uint8_t room) {
  uint8_t length = 0;
  while (length < room && Serial.available()) bytes[length++] = Serial.read();
  return length;
}
bool writeLine(void *, const uint8_t *bytes, uint8_t length) {
  return Serial.availableForWrite() >= length && Serial.write(bytes, length) == length;
}

void setup() {
  Serial.begin(1000000);
  encoder.init(); encoder.enableInterrupts(doA, doB); motor.linkSensor(&encoder);
  driver.voltage_power_supply = 12; driver.init(); motor.linkDriver(&driver);
  motor.controller = MotionControlType::torque;
  motor.voltage_limit = 6;
  motor.init(); motor.initFOC();
  config.name = "simplefoc 0.2"; config.axes = 1; config.sample_rate_hz = 500;
  config.counts_per_metre[0] = 4 * LINES / (_2PI * RADIUS_M); config.force_limit_mn[0] = 4000;
  config.clock_us = clockUs; config.measure = measure;
  config.motor_force = motorForce; config.motor_off = motorOff; config.motor_on = motorOn;
  config.read = readLine; config.write = writeLine;
  haptic_device_init(&device, &config);
  OCR0A = 128; TIMSK0 |= 1 << OCIE0A;
  wdt_enable(WDTO_30MS);
}

void loop() {
  motor.loopFOC();
  motor.move(target_v);
  haptic_device_poll(&device);
  if (ticked) { ticked = false; wdt_reset(); }
}
