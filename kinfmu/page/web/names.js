// Names on the drawing, where they cover neither each other nor the linkage. Those without such a place are left out, and
// shown at the pointer when it is on what they name.

import { distance } from "./geometry.js";
import { widthOf } from "./pen.js";
import { BUTTONS } from "./view.js";

const MOST = 80; // at once, the most important ones; more are unreadable, and those in view come with zooming in
const SPOTS = [[0.9, -0.9], [-0.9, -0.9], [0.9, 0.9], [-0.9, 0.9], [0, -1.2], [0, 1.2], [1.2, 0], [-1.2, 0]]; // around a place
const FACTORS = [1, 1.6, 2.4, 3.4]; // of the distance from it
const LEADER = 10; // [px]; a line leads to a name that is further away
const CELL = 48; // [px] of the grid that finds what is in the way
const HALF = 8; // [px] of the height of a name
const ABOVE = 30; // [px] of a name at the pointer, which a finger covers

export class Names {
    constructor(pen, view, theme) {
        Object.assign(this, { pen, view, theme });
        this.boxes = new Boxes(); // of names and pins
        this.lines = new Boxes(); // of the linkage, loads and arrows
        [this.wanted, this.hidden] = [[], []];
    }

    // Want a name next to one of its places, the best first, at a distance `off`, or on the place `inside`; gap: how far a
    // pixel is from what it names. Names of a lower rank are more important.
    add({ text, places, colour, off, rank, inside = null, gap = null }) {
        this.wanted.push({ text, places, colour, off, rank, inside, gap });
    }

    // Keep names off a line of a width.
    cover(a, b, width) {
        const count = Math.min(Math.ceil(distance(a, b) / Math.max(0.5 * width, 4)), 200);
        for (let k = 0; k <= count; k++) {
            const [x, y] = [0, 1].map((axis) => a[axis] + ((b[axis] - a[axis]) * k) / Math.max(count, 1));
            this.lines.add([x - width / 2, y - width / 2, x + width / 2, y + width / 2]);
        }
    }

    // Keep names off the sides of a polygon, or off the lines between points.
    coverAll(points, width, isClosed = false) {
        points.forEach((p, k) => k && this.cover(points[k - 1], p, width));
        if (isClosed && points.length) this.cover(points[points.length - 1], points[0], width);
    }

    coverCircle([x, y], radius) {
        const count = Math.min(Math.max(Math.ceil(radius), 12), 200);
        const at = (k) => [x + radius * Math.cos((2 * Math.PI * k) / count), y + radius * Math.sin((2 * Math.PI * k) / count)];
        this.coverAll(Array.from({ length: count + 1 }, (_, k) => at(k)), 1.5);
    }

    isFree(box) {
        return this.boxes.isFree(box) && this.lines.isFree(box);
    }

    draw() {
        this.wanted.sort((a, b) => a.rank - b.rank);
        const found = [];
        this.wanted.forEach((name, k) => {
            const spot = k < MOST && this.#place(name);
            if (!spot) {
                this.hidden.push(name);
                return;
            }
            this.boxes.add(spot.box);
            found.push({ ...spot, name });
        });
        for (const { leader } of found) if (leader) this.pen.line(leader, { width: 0.8, colour: this.theme.quiet });
        for (const { box, name } of found) {
            this.pen.text((box[0] + box[2]) / 2, (box[1] + box[3]) / 2, name.text, { colour: name.colour, size: 12, align: "center", halo: this.theme.paper });
        }
    }

    // Draw the names that are left out of what is at a pixel, within a reach.
    drawAt(pixel, reach) {
        const near = this.hidden.filter((name) => name.gap).map((name) => ({ name, gap: name.gap(pixel) })).filter(({ gap }) => gap <= reach);
        if (!near.length) return;
        const least = Math.min(...near.map(({ gap }) => gap));
        const text = [...new Set(near.filter(({ gap }) => gap <= least + 1).map(({ name }) => name.text))].join(", ");
        const { pen, view, theme } = this;
        const half = widthOf(text) / 2 + 6;
        const within = (value, edge, size) => Math.min(Math.max(value, edge), Math.max(size - edge, edge));
        const x = within(pixel[0], half + 2, view.width);
        const y = pixel[1] - ABOVE < BUTTONS + 20 ? pixel[1] + ABOVE : pixel[1] - ABOVE;
        const plate = [[x - half, y - 11], [x + half, y - 11], [x + half, y + 11], [x - half, y + 11]];
        pen.line(plate, { width: 1, colour: theme.quiet, fill: theme.paper, closed: true });
        pen.text(x, y, text, { colour: theme.ink, size: 12, align: "center" });
    }

    // Return { box, leader } of the first free rectangle for a name; null without one.
    #place({ text, places, off, inside }) {
        const width = widthOf(text) + 4;
        const at = (cx, cy) => [cx - width / 2, cy - HALF, cx + width / 2, cy + HALF];
        if (inside) {
            const box = at(...inside);
            if (this.#isIn(box) && this.isFree(box)) return { box, leader: null };
        }
        for (const factor of FACTORS) {
            for (const [x, y] of places) {
                for (const [dx, dy] of SPOTS) {
                    const box = at(x + dx * off * factor + (Math.sign(dx) * width) / 2, y + dy * off * factor);
                    if (!this.#isIn(box) || !this.isFree(box)) continue;
                    const leader = leaderTo(box, [x, y], off);
                    if (!leader || this.#isClear(leader)) return { box, leader };
                }
            }
        }
        return null;
    }

    #isIn([left, top, right, bottom]) {
        return left >= 2 && right <= this.view.width - 2 && top >= BUTTONS + 10 && bottom <= this.view.height - 2;
    }

    // Return whether a leader crosses no name and no pin.
    #isClear([a, b]) {
        return [0.1, 0.3, 0.5, 0.7, 0.9].every((part) => {
            const [x, y] = [0, 1].map((axis) => a[axis] + part * (b[axis] - a[axis]));
            return this.boxes.isFree([x - 1, y - 1, x + 1, y + 1]);
        });
    }
}

// Return the ends of the line from a place to the rectangle of its name, null if they are near.
function leaderTo([left, top, right, bottom], [x, y], off) {
    const end = [Math.min(Math.max(x, left + 4), right - 4), Math.min(Math.max(y, top + 2), bottom - 2)];
    const length = distance(end, [x, y]);
    const start = Math.max(off - 6, 0);
    if (length - start <= LEADER) return null;
    return [[x + ((end[0] - x) * start) / length, y + ((end[1] - y) * start) / length], end];
}

// Rectangles [left, top, right, bottom] that are taken, listed by the cells of a grid that they touch.
class Boxes {
    constructor() {
        this.cells = new Map();
    }

    *#touched([left, top, right, bottom]) {
        for (let i = Math.floor(left / CELL); i <= Math.floor(right / CELL); i++) {
            for (let j = Math.floor(top / CELL); j <= Math.floor(bottom / CELL); j++) yield i * 4096 + j;
        }
    }

    add(box) {
        for (const cell of this.#touched(box)) {
            if (this.cells.has(cell)) this.cells.get(cell).push(box);
            else this.cells.set(cell, [box]);
        }
    }

    isFree(box) {
        for (const cell of this.#touched(box)) {
            if (this.cells.get(cell)?.some((b) => b[0] < box[2] && b[2] > box[0] && b[1] < box[3] && b[3] > box[1])) return false;
        }
        return true;
    }
}
