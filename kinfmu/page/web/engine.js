// The engine: the compiled mechanism (WebAssembly) behind an interface of numbers.
//
// All arrays are views of the module's memory: they hold until the next call that writes them, and are not to be kept.

const ARRAYS = ["settings", "bound", "drive", "motion", "swept", "errors", "fixed", "points", "forces", "efforts", "reactions"]; // as in interface.c
const BINDINGS = ["refused", "bound", "unreached", "other branch"]; // as in interface.c
const BRIDGED = 2; // the last status of a pose with numbers: see kinfmu.Status

// Return the bytes that `packed` of kinfmu/page/module.py made a text: gzip in base64.
export async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

// Return the module that Binary.difference of kinfmu/codegen/wasm describes: pieces of a solver, and pieces that follow.
export function assembled(solver, difference) {
  const count = new DataView(difference).getUint32(0, true);
  const numbers = new DataView(difference, 4, 8 * count);
  const pieces = [];
  for (let k = 0, place = 4 + 8 * count; k < count; k += 1) {
    const start = numbers.getUint32(8 * k, true);
    const length = numbers.getUint32(8 * k + 4, true);
    const follows = start === 2 ** 32 - 1;
    pieces.push(follows ? new Uint8Array(difference, place, length) : new Uint8Array(solver, start, length));
    place += follows ? length : 0;
  }
  const module = new Uint8Array(pieces.reduce((sum, piece) => sum + piece.length, 0));
  let end = 0;
  for (const piece of pieces) {
    module.set(piece, end);
    end += piece.length;
  }
  return module;
}

// Return the compiled module of a mechanism: solver: the unpacked text of kinfmu/page/module.py; text: PageModule.text.
export async function compiled(solver, text) {
  return WebAssembly.compile(assembled(solver, await unpacked(text)));
}

// Return whether a status is that of a pose with numbers.
export function isGood(status) {
  return status <= BRIDGED;
}

export class Engine {
  // Return an engine of the mechanism of a module.
  static async load(module) {
    const instance = await WebAssembly.instantiate(module, {});
    return new Engine(instance.exports);
  }

  #code;
  #arrays;
  #drive;

  constructor(code) {
    this.#code = code;
    this.#arrays = Object.fromEntries(ARRAYS.map((name, which) => [name, this.#view(which)]));
    this.#drive = thirds(this.#arrays.drive);
    [this.q, this.qd, this.qdd] = thirds(this.#arrays.motion); // (outputs) of the last good pose
    this.status = 0; // of the last call of at
    code._initialize?.();
    code.kf_page_start();
    this.restart();
  }

  #view(which) {
    const { memory, kf_page_place, kf_page_length } = this.#code;
    return new Float64Array(memory.buffer, kf_page_place(which), kf_page_length(which));
  }

  // Values of the parameters and then of the law constants.
  get parameters() {
    return this.#arrays.bound;
  }

  // Set parameters and law constants, followed from the written lengths: { ok, result, message }. If not ok, those bound
  // before stay, and so does the pose.
  //
  // stays: the pose keeps its driver values, and "other branch" is the result if with the values, followed from the start,
  // it does not lie on the branch of the pose before. Otherwise the pose is that of the next call of at, from the start.
  bind(values, stays = false) {
    this.#expect("bind", "values", values, this.#arrays.settings.length);
    this.#arrays.settings.set(values);
    const result = BINDINGS[this.#code.kf_page_bind(stays)];
    return { ok: result === "bound", result, message: this.message };
  }

  // Why nothing closes with values at driver values u: { hasGap, text } names rows and their smallest gap near the last
  // good pose. Without a gap they close at a pose of another branch, or, without text, the values are invalid. Neither what
  // is bound nor the pose is changed.
  gap(values, u) {
    this.#expect("gap", "values", values, this.#arrays.settings.length);
    this.#expect("gap", "u", u, this.#drive[0].length);
    this.#arrays.settings.set(values);
    this.#drive[0].set(u);
    const hasGap = this.#code.kf_page_gap() !== 0;
    return { hasGap, text: this.message };
  }

  // Go where the laws start.
  restart() {
    this.#code.kf_page_restart();
    this.status = this.#code.kf_page_at();
    return this.status;
  }

  // Driver values, speeds and accelerations at a time [s], by the laws.
  driven(t) {
    this.#code.kf_page_drive(t);
    const [u, ud, udd] = this.#drive.map((part) => part.slice());
    return { u, ud, udd };
  }

  // Go on to driver values in a straight line; return the status. A pose that is not good leaves the last good one.
  at(u, ud, udd) {
    this.#set(u, ud, udd);
    this.status = this.#code.kf_page_at();
    return this.status;
  }

  // One line: why the last call of at or bind failed; empty after one that did not.
  get message() {
    const bytes = new Uint8Array(this.#code.memory.buffer, this.#code.kf_page_message());
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }

  // Distance from singular poses, 0 to 1, of the pose.
  get margin() {
    return this.#code.kf_page_margin();
  }

  // Estimated errors of q, qd and qdd of the pose, in radians and sizes.
  errors() {
    this.#code.kf_page_errors();
    return this.#arrays.errors;
  }

  // Coordinates that never move, for the parameters bound.
  fixed() {
    return this.#arrays.fixed;
  }

  // x, y of the points in the frames of their bodies, for the parameters bound.
  points() {
    return this.#arrays.points;
  }

  // Forces of the pose, at a time t [s] of laws of loads (NaN where one needs it and none is given) and with efforts of
  // external loads; null without masses and loads.
  forces(t = NaN, efforts = null) {
    if (this.#arrays.forces.length === 0) return null;
    this.#load(efforts);
    this.#code.kf_page_forces(t);
    return this.#arrays.forces;
  }

  // Reactions of joints, NaN where a pose is interpolated across a singular point, then shaking force and moment: as
  // `forces`, with the efforts set there.
  reactions(t = NaN) {
    if (this.#arrays.reactions.length === 0) return null;
    this.#code.kf_page_reactions(t);
    return this.#arrays.reactions;
  }

  // Positions at many driver values us (samples x drivers), followed from the start; the pose stays.
  //
  // columns: numbers of outputs k; with n outputs, n + k is the rate of one and 2 n + k its acceleration, for which uds
  // and udds give speeds and accelerations of the drivers (default: 1 and 0); 3 n + k is force k, for which ts gives times
  // [s] of laws of loads. Returns values (samples x columns), NaN where a pose is not good, and the status of each sample.
  sweep(us, columns, uds = null, udds = null, ts = null, efforts = null) {
    const drivers = this.#drive[0].length;
    const samples = us.length / drivers;
    const outputs = this.q.length;
    const largest = columns.reduce((most, column) => Math.max(most, column), 0);
    const orders = Math.min(4, 1 + Math.floor(largest / outputs));
    const sources = Array.from(columns, (column) =>
      column < 3 * outputs ? [this.#arrays.swept, column] : [this.#arrays.forces, column - 3 * outputs],
    );
    const values = new Float64Array(samples * columns.length);
    const status = new Uint8Array(samples);
    const [u, ud, udd] = this.#drive;
    ud.fill(1);
    udd.fill(0);
    this.#load(efforts);
    this.#code.kf_page_sweep();
    for (let sample = 0, place = 0; sample < samples; sample += 1) {
      for (let driver = 0; driver < drivers; driver += 1) {
        const number = sample * drivers + driver;
        u[driver] = us[number];
        if (uds) ud[driver] = uds[number];
        if (udds) udd[driver] = udds[number];
      }
      status[sample] = this.#code.kf_page_sample(orders, ts ? ts[sample] : NaN);
      const good = isGood(status[sample]);
      for (const [numbers, column] of sources) {
        values[place] = good ? numbers[column] : NaN;
        place += 1;
      }
    }
    return { values, status };
  }

  #load(efforts) {
    if (efforts === null) {
      this.#arrays.efforts.fill(0);
      return;
    }
    this.#expect("forces", "efforts", efforts, this.#arrays.efforts.length);
    this.#arrays.efforts.set(efforts);
  }

  #set(...given) {
    given.forEach((values, order) => {
      this.#expect("at", ["u", "ud", "udd"][order], values, this.#drive[order].length);
      this.#drive[order].set(values);
    });
  }

  #expect(call, name, values, length) {
    if (values.length !== length) {
      throw new RangeError(`${call}: ${name} has ${values.length} numbers; ${length} are needed`);
    }
  }
}

// Three views, each of a third of an array.
function thirds(array) {
  const n = array.length / 3;
  return [0, 1, 2].map((k) => array.subarray(k * n, (k + 1) * n));
}
