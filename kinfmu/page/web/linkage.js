// The mechanism that moves: engines, the pose that is shown, curves and ranges, quantities of the pose.

import { changePointsOf, comesTo, partingOf, rangesOf } from "./ranges.js";
import { compiled, Engine, isGood } from "./engine.js";
import { CAMS, axlesOf, formsOf } from "./forms.js";
import { distance, TURN, placed } from "./geometry.js";
import { dialOf } from "./marks.js";
import { grouped } from "./numbers.js";

const CURVE = 720; // points of a coupler curve
const BOX = 73; // poses that decide what fits into the view
const TOUR = 24; // steps of a tour of the motion
const FORCES = 90; // poses of a run that decide the scale of forces
const USUAL = 0.99; // part of the forces that are not outliers
const LAW = 400; // times at which the laws are tabled
const TO_CLOSING = 16; // of the way to values that do not close
const OPEN = 1e-6; // of the size; a larger gap of a pin is drawn
export const PER_TURN = 360; // samples of plots and tables over a driver, as for the measures of kinfmu check

// Return driver values, speeds and accelerations between the samples of a record.
function between({ t, columns }, at) {
    let [low, high] = [0, t.length - 1];
    while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (t[middle] <= at) low = middle;
        else high = middle;
    }
    const part = Math.min(Math.max((at - t[low]) / (t[high] - t[low]), 0), 1);
    const value = (all) => (typeof all === "number" ? all : part === 1 ? all[high] : all[low] + part * (all[high] - all[low]));
    const [u, ud, udd] = [0, 1, 2].map((order) => Float64Array.from(columns, (one) => value(one[order])));
    return { u, ud, udd };
}

// Return the number of each coordinate of a module.
function indexOf({ outputs, fixed }) {
    return new Map([...outputs.map((output) => output.name), ...fixed].map((name, k) => [name, k]));
}

// Return the mechanism of the data of a page, with its engines.
export async function linkageOf(data, solver) {
    const engines = {};
    for (const [which, part] of Object.entries(data.modules)) {
        const module = part && (await compiled(solver, part.text));
        engines[which] = part && [await Engine.load(module), await Engine.load(module)];
    }
    return new Linkage(data, engines);
}

export class Linkage {
    // engines: { written: [shown, probe], opened: [shown, probe] or null }, data: of the page
    constructor(data, engines) {
        this.data = data;
        this.engines = engines;
        this.bodies = data.bodies.map((body) => body.name);
        this.numberOf = new Map(this.bodies.map((name, k) => [name, k]));
        this.bodyOf = data.points.map((point) => this.body(point.body));
        this.parameters = (data.modules.opened || data.modules.written).parameters;
        this.bound = new Map(this.parameters.map((one) => [one.name, one.value]));
        this.failure = "";
        this.#use("written");
        this.u = Float64Array.from(this.driven(data.run.from).u);
        this.t = data.run.from;
        this.pose = null;
        this.changed = 0; // counts new lengths
        this.#tableLaws();
        this.goTo(this.u);
        if (!this.pose) throw new Error(this.failure);
        if (data.over) this.goTowards(this.u.map((value, k) => (k === data.over.driver ? data.over.from : value)));
        this.axles = axlesOf(this);
        this.findRanges();
    }

    // Return whether lengths or other numbers of the mechanism, apart from its laws, are not those of the file.
    get isChanged() {
        return this.parameters.some((one) => !one.isLaw && this.bound.get(one.name) !== one.value);
    }

    #use(which) {
        this.which = which;
        [this.shown, this.probe] = this.engines[which];
        this.part = this.data.modules[which];
        this.index = indexOf(this.part);
        this.count = this.part.outputs.length; // the coordinates after these never move
        this.triples = this.#triplesOf(this.index);
        this.locals = Float64Array.from(this.shown.points());
    }

    #triplesOf(index) {
        return this.bodies.map((body) => ["x", "y", "phi"].map((axis) => index.get(`${body}.${axis}`) ?? -1));
    }

    // ---- pose

    #keep(u, rates) {
        this.pose = this.poseOf(this.shown);
        this.u = Float64Array.from(u);
        this.rates = rates;
        let known = null;
        this.pose.reactions = () => (known ??= this.#reactionsAgain()); // the engine may be elsewhere by then
        this.failure = "";
    }

    // Return a copy of the pose of an engine; its reactions are computed when they are read, while the engine is there.
    poseOf(engine, t = this.t) {
        const fixed = engine.fixed();
        const joined = (values, rest) => {
            const all = new Float64Array(values.length + fixed.length);
            all.set(values);
            if (rest) all.set(rest, values.length);
            return all;
        };
        const { locals, triples } = this;
        const forces = engine.forces?.(this.hasTime ? t : NaN); // NaN: loads by a law over time are unknown
        return {
            q: joined(engine.q, fixed),
            qd: joined(engine.qd),
            qdd: joined(engine.qdd),
            forces: forces ? Float64Array.from(forces) : null,
            reactions: () => this.#reactionsOf(engine, t),
            locals,
            triples,
        };
    }

    // Move to driver values; return true if the pose is reached. The last good pose stays otherwise.
    goTo(u, rates = null) {
        if (this.#follow(u, rates)) return true;
        const message = this.shown.message || "This pose is unreachable.";
        const { text, hasGap } = this.shown.gap(this.shown.parameters.slice(), Float64Array.from(u));
        this.failure = hasGap ? `${message}; there, ${text}` : message;
        return false;
    }

    #follow(u, rates = null) {
        const { ud, udd } = rates || this.ratesNear();
        if (!isGood(this.shown.at(Float64Array.from(u), ud, udd))) return false;
        this.#keep(u, { ud, udd });
        return true;
    }

    // Move as far towards driver values as the mechanism goes.
    goTowards(u) {
        if (this.goTo(u)) return true;
        const failure = this.failure;
        let [reached, target] = [Float64Array.from(this.u), Float64Array.from(u)];
        for (let k = 0; k < 12; k++) {
            const middle = reached.map((value, i) => 0.5 * (value + target[i]));
            if (this.#follow(middle)) reached = middle;
            else target = middle;
        }
        this.failure = failure;
        return false;
    }

    goToTime(t, offset = null) {
        const law = this.driven(t);
        const u = offset ? law.u.map((value, k) => value + offset[k]) : law.u;
        this.t = t;
        return this.goTo(Float64Array.from(u), { ud: Float64Array.from(law.ud), udd: Float64Array.from(law.udd) });
    }

    // Return the number of a body by its name; -1 for frames that are no bodies.
    body(name) {
        return this.numberOf.get(name) ?? -1;
    }

    bodyPose(body, pose = this.pose) {
        const [x, y, phi] = pose.triples[body];
        return x < 0 ? [0, 0, 0] : [pose.q[x], pose.q[y], pose.q[phi]];
    }

    local(point, pose = this.pose) {
        return [pose.locals[2 * point], pose.locals[2 * point + 1]];
    }

    point(point, pose = this.pose) {
        return placed(this.bodyPose(this.bodyOf[point], pose), ...this.local(point, pose));
    }

    // Return velocity and acceleration of a place of a body that is now at p.
    motionOf(body, p, pose = this.pose) {
        const [ix, iy, iphi] = pose.triples[body];
        if (ix < 0) return { v: [0, 0], a: [0, 0] };
        const { q, qd, qdd } = pose;
        const dx = p[0] - q[ix];
        const dy = p[1] - q[iy];
        const w = qd[iphi];
        return {
            v: [qd[ix] - w * dy, qd[iy] + w * dx],
            a: [qdd[ix] - qdd[iphi] * dy - w * w * dx, qdd[iy] + qdd[iphi] * dx - w * w * dy],
        };
    }

    // ---- laws

    // Return driver values, speeds and accelerations at a time: those of the laws, or of the samples of a record.
    driven(t, engine = this.shown) {
        return this.data.samples ? between(this.data.samples, t) : engine.driven(t);
    }

    // Return whether the horizontal axis of the motion is time, not the number of a sample.
    get hasTime() {
        return !this.data.samples || this.data.samples.isTime;
    }

    #tableLaws() {
        const { from, to } = this.data.run;
        this.law = Array.from({ length: LAW + 1 }, (_, k) => {
            const t = from + ((to - from) * k) / LAW;
            return { t, u: Float64Array.from(this.driven(t).u) };
        });
    }

    // Return by how much a value of a driver is more than another one, without the cycles after which all repeats.
    apart(k, value, other) {
        const period = TURN * (this.turns?.[k] ?? this.data.drivers[k].turns ?? 0);
        return value - other - (period ? period * Math.round((value - other) / period) : 0);
    }

    // Return the speed of the only driver if it is constant and gives the motion, else 0.
    get speed() {
        const { samples, drivers, run } = this.data;
        return !samples && drivers.length === 1 && drivers[0].law === "constant_speed" ? this.driven(run.from).ud[0] : 0;
    }

    // Return the time after which the only driver has made a whole cycle, which may be longer than the run.
    get cycleEnd() {
        const { from, to } = this.data.run;
        return Math.max(to, this.speed && this.turns[0] ? from + (TURN * this.turns[0]) / Math.abs(this.speed) : to);
    }

    // Return the time at which the laws come nearest to driver values; of several, that nearest to the time shown.
    timeNear(u) {
        if (this.speed) return this.#timeAt(u[0]);
        const gap = (law) =>
            law.u.reduce((sum, value, k) => {
                const apart = this.apart(k, u[k], value);
                return sum + apart * apart;
            }, 0);
        let best = this.law[0];
        let least = Infinity;
        for (const law of this.law) {
            const g = gap(law) + 1e-9 * Math.abs(law.t - this.t);
            if (g < least) [best, least] = [law, g];
        }
        const step = (this.data.run.to - this.data.run.from) / LAW;
        let [low, high] = [best.t - step, best.t + step];
        for (let k = 0; k < 40; k++) {
            const [a, b] = [low + (high - low) / 3, high - (high - low) / 3];
            if (gap({ u: this.driven(a).u.slice() }) < gap({ u: this.driven(b).u.slice() })) high = b;
            else low = a;
        }
        return Math.min(Math.max(0.5 * (low + high), this.data.run.from), this.data.run.to);
    }

    // Return the time at which the only driver, at constant speed, has a value; within the run if it does not turn.
    #timeAt(value, near = this.t) {
        const { from, to } = this.data.run;
        const t = from + (value - this.law[0].u[0]) / this.speed;
        if (!this.turns?.[0]) return Math.min(Math.max(t, from), to);
        const cycle = (TURN * this.turns[0]) / Math.abs(this.speed);
        const first = t - cycle * Math.floor((t - from) / cycle);
        const last = Math.floor((this.cycleEnd - first) / cycle);
        return first + cycle * Math.min(Math.max(Math.round((near - first) / cycle), 0), last);
    }

    // Return speeds and accelerations of the drivers: those of their laws at the time that is shown.
    ratesNear() {
        const { ud, udd } = this.driven(this.t);
        return { ud: Float64Array.from(ud), udd: Float64Array.from(udd) };
    }

    // ---- lengths

    // Bind other values of parameters (a Map); return true if the mechanism closes with them at its driver values, on the
    // branch that is shown. If not, values and pose stay as they are, and `failure` states why.
    setValues(values) {
        const which = this.#whichFor(values);
        const through = this.which === "opened" ? "opened" : which; // the engine that follows the pose to the values
        const [shown, probe] = this.engines[through];
        const vector = this.#vector(through, values);
        const before = this.#vector(through, this.bound);
        const comes = through === this.which || comesTo(this, through, before, this.shown);
        const { ok, result, message } = comes ? shown.bind(vector, true) : { result: "other branch" };
        const isThere = ok && (through === which || comesTo(this, which, this.#vector(which, values), shown));
        if (ok && !isThere) shown.bind(before, true);
        this.isOtherBranch = result === "other branch" || (ok && !isThere);
        this.isInvalid = result === "refused" && message.includes(" must be ");
        if (this.isOtherBranch) {
            this.failure = partingOf(this, probe, before, vector);
            return false;
        }
        if (this.isInvalid) {
            this.failure = message.replace(/^parameters .*?: (?=\[)/, "");
            return false;
        }
        if (!ok) {
            const here = result === "unreached" ? shown.gap(vector, this.u).text : "";
            this.failure = result === "unreached" ? message + (here && `; there, ${here}`) : this.#gapOf(shown, vector, message || "the mechanism does not close");
            this.isOtherBranch = this.failure.includes("on another branch only");
            return false;
        }
        this.#use(which);
        if (!this.goTo(this.u)) throw new Error(this.failure);
        if (through === which) probe.bind(vector);
        this.changed += 1;
        const areLaws = this.parameters.some((one) => one.isLaw && values.get(one.name) !== this.bound.get(one.name));
        this.bound = new Map(values);
        if (areLaws) this.#tableLaws();
        return true;
    }

    // Return which engines solve with values: those of the file as written as long as no plain number is changed.
    #whichFor(values) {
        return this.parameters.some((one) => one.isPlace && values.get(one.name) !== one.value) ? "opened" : "written";
    }

    // Return values for engines, in their order.
    #vector(which, values) {
        return Float64Array.from(this.data.modules[which].parameters, (one) => values.get(one.name) ?? one.value);
    }

    // Return why values do not close: rows and gap at the driver values shown, or else where the laws start.
    #gapOf(engine, vector, message) {
        const here = engine.gap(vector, this.u);
        if (here.hasGap || !here.text) return here.text || message;
        const there = engine.gap(vector, this.law[0].u);
        if (there.hasGap) return `at the start of the run, ${there.text}`;
        const [, rows, gap] = message.match(/: rows (.*) leave a gap of (.*)$/) || []; // of the pose from which all are followed
        if (rows) return `at the pose as written, rows ${rows} do not close: gap ${gap}`;
        return message.includes("beyond a singular point") ? `${here.text}, beyond a singular point` : `${message}; ${here.text}`;
    }

    // Return for values (a Map) that do not close { values, pose, gaps }: the last values on the way to them that close, and
    // with them the pose of all bodies with the points as set; gaps: pairs of places of one pin. Null if that is unknown.
    closing(values) {
        const which = this.#whichFor(values);
        const [, probe] = this.engines[which];
        const at = (part) => new Map([...this.bound].map(([name, from]) => [name, from + part * (values.get(name) - from)]));
        const isReached = (part) => probe.bind(this.#vector(which, at(part))).ok && isGood(probe.at(this.u, this.rates.ud, this.rates.udd));
        const before = isReached(0) && Float64Array.from(probe.points());
        let [low, high] = [0, 1];
        for (let k = 0; before && k < TO_CLOSING; k++) {
            const middle = 0.5 * (low + high);
            if (isReached(middle)) low = middle;
            else high = middle;
        }
        const isKnown = low > 0 && isReached(low);
        const locals = isKnown && probe.points().map((x, k) => x + ((x - before[k]) * (1 - low)) / low);
        const pose = isKnown && { ...this.pose, q: this.poseOf(probe).q, locals, triples: this.#triplesOf(indexOf(this.data.modules[which])) };
        probe.bind(this.#vector(which, this.bound));
        if (!isKnown) return null;
        const pins = this.data.joints.filter(({ type, points }) => type === "revolute" && points);
        const gaps = pins.map(({ points }) => points.map((point) => this.point(point, pose))).filter(([a, b]) => distance(a, b) > OPEN * this.data.size);
        return gaps.length ? { values: at(low), pose, gaps } : null;
    }

    // ---- curves and ranges, by the engine that is not shown

    // Return the driver values of a curve: over the driver's range, or over the run with several drivers.
    #samples(count, isOverDriver = this.data.drivers.length === 1, all = this.#countOf("driver", count)) {
        const { run } = this.data;
        if (!isOverDriver) {
            return Array.from({ length: count + 1 }, (_, k) =>
                Float64Array.from(this.driven(run.from + ((run.to - run.from) * k) / count, this.probe).u),
            );
        }
        const [low, high] = this.ranges[0];
        return Array.from({ length: all + 1 }, (_, k) => Float64Array.of(low + ((high - low) * k) / all));
    }

    #swept(samples, columns) {
        const n = this.data.drivers.length;
        const us = new Float64Array(samples.length * n);
        samples.forEach((u, k) => us.set(u, k * n));
        return this.probe.sweep(us, columns);
    }

    // Visit poses of the cycle of the only driver, or of the run, each as if it were shown.
    tour(visit) {
        const { pose, u } = this;
        const isCycle = this.data.over || (this.data.drivers.length === 1 && this.turns[0]);
        this.probe.restart();
        for (const at of this.#samples(TOUR, isCycle, TOUR)) {
            if (!isGood(this.probe.at(at, new Float64Array(at.length).fill(1), new Float64Array(at.length)))) continue;
            [this.pose, this.u] = [this.poseOf(this.probe), at];
            visit();
        }
        [this.pose, this.u] = [pose, u];
    }

    // Find what the lengths decide: ranges of the drivers, each with the others at the start of their laws, limits, change
    // points, shapes.
    findRanges() {
        Object.assign(this, rangesOf(this));
        this.changePoints = changePointsOf(this);
        Object.assign(this, formsOf(this));
        this.shapesOf = grouped(this.shapes, (shape) => shape.kind);
    }

    // Return the value of a driver within its range, if it turns without end.
    wrapped(k) {
        const [low, high] = this.ranges[k];
        const value = this.u[k];
        if (this.data.over || this.data.drivers[k].kind !== "angle" || this.limits.some((limit) => limit.driver === k)) return value;
        const period = high - low;
        return low + (((value - low) % period) + period) % period;
    }

    // Return whether the run comes through a value of the only driver; true with several, whose curves are over the run.
    #isOfRun([value]) {
        if (this.data.drivers.length > 1) return true;
        const [low, high] = [Math.min, Math.max].map((of) => of(...this.law.map(({ u }) => u[0])));
        const near = 1e-6 * (this.ranges[0][1] - this.ranges[0][0]);
        const period = this.data.drivers[0].kind === "angle" && !this.limits.length ? this.ranges[0][1] - this.ranges[0][0] : 0;
        const first = period ? value + period * Math.ceil((low - near - value) / period) : value;
        return first >= low - near && first <= high + near;
    }

    // Return polylines of the points with these numbers, over the driver's range or the run: [x, y, whether it is of the run].
    curves(points, count = CURVE) {
        const bodies = [...new Set(points.map((point) => this.bodyOf[point]))].filter((body) => this.triples[body][0] >= 0);
        const columns = bodies.flatMap((body) => this.triples[body]);
        if (!columns.length) return points.map(() => []);
        const samples = this.#samples(count);
        const moving = columns.map((column) => (column < this.count ? column : 0));
        const { values, status } = this.#swept(samples, moving);
        const width = columns.length;
        const areOfRun = samples.map((u) => this.#isOfRun(u));
        columns.forEach((column, place) => {
            if (column < this.count) return;
            for (let k = 0; k < samples.length; k++) values[k * width + place] = this.pose.q[column];
        });
        return points.map((point) => {
            const place = 3 * bodies.indexOf(this.bodyOf[point]);
            if (place < 0) return [];
            const [x, y] = [this.locals[2 * point], this.locals[2 * point + 1]];
            const line = [];
            for (let k = 0; k < samples.length; k++) {
                if (!isGood(status[k])) continue;
                const at = k * width + place;
                const c = Math.cos(values[at + 2]);
                const s = Math.sin(values[at + 2]);
                line.push([values[at] + c * x - s * y, values[at + 1] + s * x + c * y, areOfRun[k]]);
            }
            return line;
        });
    }

    // Return the corners of the box around all points over the range.
    box() {
        const all = this.data.points.map((_, k) => k);
        let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
        const add = ([x, y]) => {
            [x0, y0, x1, y1] = [Math.min(x0, x), Math.min(y0, y), Math.max(x1, x), Math.max(y1, y)];
        };
        for (const line of this.curves(all, BOX)) line.forEach(add);
        all.forEach((k) => add(this.point(k)));
        this.data.drivers.forEach((_, k) => {
            const dial = dialOf(this, k);
            for (let i = 0; dial && i <= BOX; i++) add(dial.on(dial.low + (dial.span * i) / BOX, dial.reach));
        });
        for (const shape of this.shapes) {
            if (!shape.radius && !CAMS.includes(shape.kind)) continue;
            const body = this.body(shape.frame);
            if (body < 0) continue;
            for (const [x, y] of shape.points) {
                const p = placed(this.bodyPose(body), x, y);
                const r = shape.radius || 0;
                add([p[0] - r, p[1] - r]);
                add([p[0] + r, p[1] + r]);
            }
        }
        return [x0, y0, x1, y1];
    }

    // ---- quantities

    #reactionsAgain() {
        this.shown.at(this.u, this.rates.ud, this.rates.udd);
        return this.#reactionsOf(this.shown, this.t);
    }

    // Return reactions by name: of joints, and shaking force and moment; null without masses and loads.
    #reactionsOf(engine, t) {
        const values = engine.reactions(this.hasTime ? t : NaN);
        return values && new Map(this.part.reactions.map(({ name }, k) => [name, values[k]]));
    }

    // Return the largest of the forces of a kind over the run, without outliers; read(pose): their sizes.
    largestForce(kind, read) {
        const known = this.largest?.get(kind);
        if (known && known.changed === this.changed) return known.most;
        const { run } = this.data;
        const sizes = [];
        this.probe.restart();
        for (let k = 0; k <= FORCES; k++) {
            const t = run.from + ((run.to - run.from) * k) / FORCES;
            const { u, ud, udd } = this.driven(t, this.probe);
            if (!isGood(this.probe.at(u, ud, udd))) continue;
            sizes.push(...read(this.poseOf(this.probe, t)).filter(Number.isFinite));
        }
        sizes.sort((a, b) => a - b);
        const most = sizes.length ? sizes[Math.floor(USUAL * (sizes.length - 1))] : 0;
        this.largest = (this.largest || new Map()).set(kind, { changed: this.changed, most });
        return most;
    }

    // Return the number of steps of a turn, or of the run, for all turns of the range.
    #countOf(over, count) {
        return over === "driver" && !this.data.over ? count * (this.turns[0] || 1) : count;
    }

    // Visit poses over the driver ("driver") or the run ("time"), in `count` steps of a turn or of the run: visit(x, pose or
    // null). At a constant speed of the driver, loads have the time at which it comes to x; else that shown.
    visit(over, count, visit) {
        const { run } = this.data;
        const { probe, speed } = this;
        const rates = this.ratesNear();
        const [low, high] = over === "time" ? [run.from, run.to] : this.ranges[0];
        const all = this.#countOf(over, count);
        probe.restart();
        for (let k = 0; k <= all; k++) {
            const x = low + ((high - low) * k) / all;
            const law = over === "time" ? this.driven(x, probe) : { u: Float64Array.of(x), ...rates };
            const t = over === "time" ? x : speed ? this.#timeAt(x, run.from) : this.t;
            visit(x, isGood(probe.at(law.u, law.ud, law.udd)) ? this.poseOf(probe, t) : null);
        }
    }
}
