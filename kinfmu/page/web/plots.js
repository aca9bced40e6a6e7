// Plots of quantities over time or the driver, with one cursor for all.

import { describe } from "./elements.js";
import { transmissions } from "./instants.js";
import { PER_TURN } from "./linkage.js";
import { degrees, niceStep, number } from "./numbers.js";
import { FONT } from "./pen.js";

const OUTSIDE = 0.01; // part of the values on either side that may be outside the plot
const MARGIN = { left: 58, right: 10, top: 10, bottom: 24 };

const DEGREES = 180 / Math.PI;

// Return all quantities that can be plotted: { id, label, group, unit, read(linkage, pose) }: of points of interest, angles of
// bodies, those of joints, transmission angles, forces; the frames of bodies, which are often at no place of interest, last.
export function quantities(linkage) {
    const found = ofOutputs(linkage, (output) => rank(linkage, output) < 2);
    found.push(...quantitiesOfJoints(linkage));
    linkage.data.loops.forEach((loop, k) => {
        const label = `transmission angle ${loop.coupler}-${loop.output}`;
        const read = (one, pose) => (transmissions(one, pose)[k].angle * 180) / Math.PI;
        found.push({ id: label, label, group: "transmission", unit: "deg", read });
    });
    linkage.part.forces.forEach(({ name, unit }, k) => {
        found.push({ id: name, label: name, group: "forces", unit, read: (one, pose) => (pose.forces ? pose.forces[k] : NaN) });
    });
    linkage.part.reactions.forEach(({ name, unit }) => {
        found.push({ id: name, label: name, group: "reactions", unit, read: (_, pose) => pose.reactions().get(name) });
    });
    return [...found, ...ofOutputs(linkage, (output) => rank(linkage, output) === 2)];
}

// Return 0 for a coordinate of a point of interest, 1 for the angle of a body, 2 for a coordinate of its frame.
function rank(linkage, output) {
    if (linkage.data.interest.some((one) => one.name === output.owner)) return 0;
    return output.units[0] === "rad" ? 1 : 2;
}

function ofOutputs(linkage, isWanted) {
    const outputs = linkage.part.outputs.filter(isWanted).sort((a, b) => rank(linkage, a) - rank(linkage, b));
    return outputs.flatMap((output) => output.names.map((label, order) => {
        const unit = output.units[order];
        const scale = unit.startsWith("rad") ? DEGREES : 1;
        const read = (one, pose) => [pose.q, pose.qd, pose.qdd][order][one.index.get(output.name)] * scale;
        return { id: label, label, group: rank(linkage, output) === 2 ? `frame of ${output.owner}` : output.owner, unit: unit.replace(/^rad/, "deg"), read };
    }));
}

// Return quantities of joints: of a pin its place, speed and acceleration, and the angle between two links that move; of a
// slide its travel and speed.
function quantitiesOfJoints(linkage) {
    const { unit, joints } = linkage.data;
    const seen = new Set();
    return joints.flatMap(({ name, type, points, axis }) => {
        if (points?.length !== 2) return [];
        const bodies = points.map((point) => linkage.bodyOf[point]);
        const isMoving = bodies.map((body) => linkage.triples[body][0] >= 0);
        const quantity = (label, of, read) => ({ id: `joint ${name}.${label}`, label: `${name}.${label}`, group: `joint ${name}`, unit: of, read });
        const found = [];
        const between = (one, pose) => (one.bodyPose(bodies[1], pose)[2] - one.bodyPose(bodies[0], pose)[2]) * DEGREES;
        if (type === "revolute" && isMoving[0] && isMoving[1]) {
            const [point] = points;
            const motion = (one, pose) => one.motionOf(bodies[0], one.point(point, pose), pose);
            const at = String(linkage.point(point).map((x) => number(x / linkage.data.size, 9)));
            if (!seen.has(at)) {
                found.push(quantity("x", unit, (one, pose) => one.point(point, pose)[0]), quantity("y", unit, (one, pose) => one.point(point, pose)[1]));
                found.push(quantity("speed", `${unit}/s`, (one, pose) => Math.hypot(...motion(one, pose).v)), quantity("acceleration", `${unit}/s2`, (one, pose) => Math.hypot(...motion(one, pose).a)));
            }
            seen.add(at);
            found.push(quantity("angle", "deg", between));
        }
        if (axis !== undefined && type !== "fixed") {
            const along = (one, pose, [x, y]) => {
                const turn = (one.bound.get(`joints.${name}.axis`) ?? axis) + one.bodyPose(bodies[0], pose)[2];
                return x * Math.cos(turn) + y * Math.sin(turn);
            };
            const apart = ([x, y], [x0, y0]) => [x - x0, y - y0];
            const ends = (one, pose) => points.map((point) => one.point(point, pose));
            found.push(quantity("travel", unit, (one, pose) => along(one, pose, apart(...ends(one, pose).reverse()))));
            found.push(quantity("speed", `${unit}/s`, (one, pose) => along(one, pose, apart(...[1, 0].map((k) => one.motionOf(bodies[k], ends(one, pose)[1], pose).v)))));
        }
        return found;
    });
}

// Return the first quantities to plot. A point that slides has only one coordinate that moves, a point of the ground none.
export function defaults(linkage, all) {
    const { interest, loops, drivers } = linkage.data;
    const known = (owner, ...kinds) => kinds.map((kind) => `${owner}.${kind}`).filter((id) => all.some((one) => one.id === id));
    const place = interest.map(({ name }) => known(name, "x", "y")).find((moving) => moving.length) || [];
    const [effort] = linkage.part.forces.length ? known(drivers[0].name, "torque", "force") : [];
    if (effort) return [effort, ...place.slice(-1)];
    if (place.length) return place;
    const output = loops.length ? loops[0].output : linkage.bodies[linkage.bodies.length - 1];
    const wanted = known(output, "phi", "x");
    return wanted.length ? wanted.slice(0, 1) : all.slice(0, 1).map((one) => one.id);
}

// Return x and values of quantities over "time" or "driver"; values are NaN at poses without numbers.
export function sampled(linkage, over, wanted, count = PER_TURN) {
    const x = [];
    const columns = wanted.map(() => []);
    linkage.visit(over, count, (at, pose) => {
        x.push(at);
        wanted.forEach((one, k) => columns[k].push(pose ? one.read(linkage, pose) : NaN));
    });
    return { x, columns };
}

// Return the range of values that a plot shows: as shown_range of kinfmu/run/axis.py, without a few values that would flatten
// all others, which grow without bound next to a singular pose.
export function rangeOf(values) {
    const known = values.filter(Number.isFinite).sort((a, b) => a - b);
    if (!known.length) return [0, 1];
    const at = (part) => {
        const place = part * (known.length - 1);
        const k = Math.floor(place);
        return known[k] + (place - k) * ((known[k + 1] ?? known[k]) - known[k]);
    };
    const [least, most] = [known[0], known[known.length - 1]];
    const [low, high] = [at(OUTSIDE), at(1 - OUTSIDE)];
    const width = high - low;
    if (width > 0 && (least < low - width || most > high + width)) return [low - width / 2, high + width / 2];
    const noise = 1e-9 * Math.max(Math.abs(least), Math.abs(most), 1e-12);
    if (most - least < noise) return [least - Math.max(Math.abs(least) * 0.1, 1e-6), most + Math.max(Math.abs(most) * 0.1, 1e-6)];
    return [least, most];
}

export class Plot {
    constructor(canvas, onPick) {
        this.canvas = canvas;
        new ResizeObserver(() => this.#measure()).observe(canvas); // asking for the size in each frame takes the browser long
        const pick = (event) => {
            if (!this.range) return;
            const box = canvas.getBoundingClientRect();
            const part = (event.clientX - box.left - MARGIN.left) / (box.width - MARGIN.left - MARGIN.right);
            onPick(this.range[0] + Math.min(1, Math.max(0, part)) * (this.range[1] - this.range[0]));
        };
        canvas.addEventListener("pointerdown", (event) => {
            canvas.setPointerCapture(event.pointerId);
            pick(event);
        });
        canvas.addEventListener("pointermove", (event) => {
            if (event.buttons) pick(event);
        });
        canvas.addEventListener("keydown", (event) => {
            const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
            if (!way || !this.range) return;
            event.preventDefault();
            const step = (this.range[1] - this.range[0]) / (event.shiftKey ? 36 : 360);
            this.cursor = Math.min(this.range[1], Math.max(this.range[0], this.cursor + way * step)); // for the next press
            onPick(this.cursor);
        });
    }

    #measure() {
        this.size = [this.canvas.clientWidth, this.canvas.clientHeight];
        if (this.last) this.draw(this.last);
    }

    draw(what) {
        this.last = what;
        const { x, values, label, unit, cursor, now, theme, isAngle, xLabel, isPlaying } = what;
        if (!this.size?.[0]) this.size = [this.canvas.clientWidth, this.canvas.clientHeight];
        const [width, height] = this.size;
        const { canvas } = this;
        const ratio = window.devicePixelRatio || 1;
        if (!width || !height) return;
        if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
        if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
        const c = canvas.getContext("2d");
        c.setTransform(ratio, 0, 0, ratio, 0, 0);
        c.clearRect(0, 0, width, height);
        this.range = [x[0], x[x.length - 1]];
        this.cursor = cursor;
        let [low, high] = rangeOf(values);
        const pad = 0.06 * (high - low);
        [low, high] = [low - pad, high + pad];
        const px = (value) => MARGIN.left + ((value - this.range[0]) / (this.range[1] - this.range[0] || 1)) * (width - MARGIN.left - MARGIN.right);
        const py = (value) => height - MARGIN.bottom - ((value - low) / (high - low)) * (height - MARGIN.top - MARGIN.bottom);
        c.font = `11px ${FONT}`;
        c.strokeStyle = theme.grid;
        c.fillStyle = theme.quiet;
        c.lineWidth = 1;
        c.textBaseline = "middle";
        c.textAlign = "right";
        const stepY = niceStep((high - low) / 4);
        for (let k = Math.ceil(low / stepY); k * stepY <= high; k++) {
            const y = py(k * stepY);
            line(c, [[MARGIN.left, y], [width - MARGIN.right, y]]);
            c.fillText(number(k * stepY, 4), MARGIN.left - 6, y);
        }
        const span = this.range[1] - this.range[0];
        const stepX = isAngle ? (Math.PI / 180) * [1, 2, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1440].find((d) => (d * Math.PI) / 180 >= span / 6 || d === 1440) : niceStep(span / 6 || 1);
        c.textAlign = "center";
        for (let k = Math.ceil(this.range[0] / stepX - 1e-9); k * stepX <= this.range[1] * (1 + 1e-12) + 1e-12; k++) {
            const at = px(k * stepX);
            line(c, [[at, MARGIN.top], [at, height - MARGIN.bottom]]);
            const text = isAngle ? degrees(k * stepX, 0) : number(k * stepX, 4);
            const half = 0.5 * c.measureText(text).width; // the last label may end at the edge, where the unit of other axes is
            if (isAngle || at < width - 34) c.fillText(text, Math.min(at, width - half - 2), height - MARGIN.bottom + 12);
        }
        c.textAlign = "right";
        c.fillText(xLabel, width - 4, height - MARGIN.bottom + 12);
        c.strokeStyle = theme.accent;
        c.lineWidth = 2;
        c.lineJoin = "round";
        c.save();
        c.beginPath();
        c.rect(MARGIN.left, MARGIN.top, width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom);
        c.clip();
        c.beginPath();
        let isDown = false;
        values.forEach((value, k) => {
            if (!Number.isFinite(value)) {
                isDown = false;
                return;
            }
            if (isDown) c.lineTo(px(x[k]), py(value));
            else c.moveTo(px(x[k]), py(value));
            isDown = true;
        });
        c.stroke();
        c.restore();
        if (Number.isFinite(cursor)) {
            const at = px(Math.min(this.range[1], Math.max(this.range[0], cursor)));
            c.strokeStyle = theme.ink;
            c.lineWidth = 1;
            line(c, [[at, MARGIN.top], [at, height - MARGIN.bottom]]);
            if (now >= low && now <= high) {
                c.fillStyle = theme.ink;
                c.beginPath();
                c.arc(at, py(now), 4, 0, 2 * Math.PI);
                c.fill();
            }
        }
        if (!isPlaying) describe(canvas, `${label}: ${number(now)} ${unit}`);
    }
}

function line(c, [a, b]) {
    c.beginPath();
    c.moveTo(...a);
    c.lineTo(...b);
    c.stroke();
}
