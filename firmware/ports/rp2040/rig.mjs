// The rig around an RP2040 in rp2040js: its UART is descriptor 3, its PWM pulls handles, its encoders are words of memory.
//
//     build/onpty LINK node ports/rp2040/rig.mjs build/rp2040.bin [1 or 2] [rest] [swapped]
//
// RP2040JS is the address of the module, where it is not installed beside. Orders and answers are those of ports/native.
import fs from 'node:fs';

const { Simulator } = await import(process.env.RP2040JS ?? 'rp2040js');
const [image, ...options] = [fs.readFileSync(process.argv[2]), ...process.argv.slice(3)];
const axes = options.includes('2') ? 2 : 1, amplitude = options.includes('rest') ? 0 : 0.03, swapped = options.includes('swapped');
const FLASH = 0x10000000, PWM_DUTY = 0x4005000c, ENCODERS = 0x20040000, FAULT = 0x20040008;
const WATCHDOG = 0x40058000, WATCHDOG_CONTROL = WATCHDOG, THREAD_MODE = 0;
const FULL_N = 20, PWM_PERIOD = 2000, COUNTS_PER_METRE = 100000;
const SLICE_NS = 200e3, CYCLE_NS = 8, BYTE_NS = 10e3, LARGEST_LAG_NS = 500e6, CATCH_UP_NS = 5e6;
const FAULTS = ['mend', 'hang loop', 'hang write', 'hang clock', 'hang deaf', 'hang kicking', 'cut'];

const { clock, rp2040: mcu } = new Simulator();
mcu.logger = { debug() {}, warn() {}, info() {}, error: (...text) => console.error(...text) };
let resets = -1;
// There is no boot ROM: the image begins with its vectors. The simulator resets less than a chip does.
function boot() {
  resets++;
  mcu.reset();
  mcu.flash.set(image);
  mcu.writeUint32(FAULT, 0);
  mcu.writeUint32(WATCHDOG_CONTROL, 0);
  for (let axis = 0; axis < 2; axis++) mcu.writeUint32(PWM_DUTY + 0x14 * axis, 0);
  const stack = image.readUInt32LE(0), start = image.readUInt32LE(4) & ~1;
  Object.assign(mcu.core, {
    VTOR: FLASH, SP: stack, PC: start, waiting: false, PM: false, IPSR: 0, pendingInterrupts: 0, enabledInterrupts: 0,
    currentMode: THREAD_MODE,
  });
}
let bites = false;
mcu.peripherals[WATCHDOG >>> 12].onWatchdogTrigger = () => {
  // Left on, the simulator's watchdog would trigger for ever in the same moment.
  mcu.writeUint32(WATCHDOG_CONTROL, 0);
  bites = true;
};
boot();

// As plant.c: a mass with Coulomb and viscous friction, and a hand at the end of an arm; the implicit midpoint rule.
const plants = [0.5, 0.7].map((frequency) => ({ frequency, time: 0, position: 0, velocity: 0, work: 0, travel: 0 }));
function step(plant, h, force) {
  const mass = 1.4, coulomb = 0.8, viscous = 2, stiffness = 400, damping = 20;
  const since = plant.time + h / 2 - 0.5, omega = 2 * Math.PI * plant.frequency, grown = Math.min(Math.max(since, 0), 1);
  const wanted = amplitude * grown * Math.sin(omega * since);
  const speed = since > 0 ? amplitude * ((since < 1 ? Math.sin(omega * since) : 0) + grown * omega * Math.cos(omega * since)) : 0;
  const drag = 0.5 * stiffness * h + damping + viscous, inertia = 2 * mass / h;
  const drive = inertia * plant.velocity + force + stiffness * (wanted - plant.position) + damping * speed;
  const middle = Math.abs(drive) > coulomb ? (drive - Math.sign(drive) * coulomb) / (inertia + drag) : 0;
  const end = 2 * middle - plant.velocity;
  plant.velocity = end * middle < 0 || middle === 0 ? 0 : end;
  plant.position += h * middle;
  plant.work += force * middle * h;
  plant.travel += Math.abs(middle) * h;
  plant.time += h;
}

const sent = [], waiting = [], forces = [0, 0], buffer = Buffer.alloc(64);
mcu.uart[0].onByte = (byte) => sent.push(byte);
let lastBytesNs = 0, lastOnNs = 0, lastOrderNs = 0, instructions = 0;

// What has come on a descriptor that does not wait; null at its end.
function read(descriptor, length) {
  try {
    const got = fs.readSync(descriptor, buffer, 0, length);
    return got ? buffer.subarray(0, got) : null;
  } catch (error) {
    if (error.code === 'EAGAIN') return Buffer.alloc(0);
    throw error;
  }
}

function obey(order) {
  if (order !== 'stats') lastOrderNs = clock.nanos;
  if (order === 'clear') for (const plant of plants) plant.work = plant.travel = 0;
  if (order === 'reset') bites = true;
  if (FAULTS.includes(order)) mcu.writeUint32(FAULT, FAULTS.indexOf(order));
  const each = plants.slice(0, axes).map((plant, axis) => ({
    force_n: forces[axis], position_m: plant.position, motor_work_j: plant.work, travel_m: plant.travel,
  }));
  const answer = {
    resets, off_after_command_ms: (lastOnNs - lastBytesNs) / 1e6, off_after_order_ms: (lastOnNs - lastOrderNs) / 1e6,
    instructions, board_s: clock.nanos / 1e9, axes: each,
  };
  fs.writeSync(1, JSON.stringify(answer) + '\n');
}

// Lives through a slice; bytes come one at a time, as on the line.
function live() {
  const end = clock.nanos + SLICE_NS;
  let next = clock.nanos + BYTE_NS;
  while (clock.nanos < end) {
    if (waiting.length && clock.nanos >= next && !mcu.uart[0].rxFIFO.full) {
      mcu.uart[0].feedByte(waiting.shift());
      next = clock.nanos + BYTE_NS;
    }
    if (mcu.core.waiting) {
      const stop = Math.min(clock.nanosToNextAlarm || 1e9, end - clock.nanos, waiting.length ? next - clock.nanos : 1e9);
      clock.tick(Math.max(stop, CYCLE_NS));
    } else {
      clock.tick(mcu.core.executeInstruction() * CYCLE_NS);
      instructions++;
    }
    if (bites) {
      bites = false;
      boot();
    }
  }
}

const began = process.hrtime.bigint(), sleeper = new Int32Array(new SharedArrayBuffer(4));
const realNs = () => Number(process.hrtime.bigint() - began);
let orders = '';
for (let dueNs = realNs(); ; ) {
  const startedNs = realNs(), line = read(3, 20), input = read(0, 64);
  if (input === null) break;
  orders += input;
  for (let end; (end = orders.indexOf('\n')) >= 0; orders = orders.slice(end + 1)) obey(orders.slice(0, end));
  if (line?.length) {
    waiting.push(...line);
    lastBytesNs = clock.nanos;
  }
  live();
  for (let axis = 0; axis < axes; axis++) {
    const duty = mcu.readUint32(PWM_DUTY + 0x14 * axis);
    forces[axis] = ((duty & 0xffff) - (duty >>> 16)) / PWM_PERIOD * FULL_N;
    for (let i = 0; i < 4; i++) step(plants[axis], SLICE_NS / 4e9, forces[axis]);
    mcu.writeUint32(ENCODERS + 4 * (swapped ? 1 - axis : axis), Math.round(plants[axis].position * COUNTS_PER_METRE) | 0);
  }
  if (forces[0] !== 0 || forces[1] !== 0) lastOnNs = clock.nanos;
  if (sent.length) {
    try { fs.writeSync(3, Buffer.from(sent)); } catch (error) { if (error.code !== 'EAGAIN') throw error; }
    sent.length = 0;
  }
  dueNs += SLICE_NS;
  const aheadNs = dueNs - realNs();
  if (aheadNs < -LARGEST_LAG_NS) dueNs = realNs();
  if (aheadNs > 0) Atomics.wait(sleeper, 0, 0, aheadNs / 1e6);
  // It catches up at twice the speed of time at most: faster, and the host has no time to feed the watchdog.
  else if (aheadNs < -CATCH_UP_NS) while (realNs() < startedNs + SLICE_NS / 2);
}
