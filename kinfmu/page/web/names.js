// Names on the drawing, where they cover neither each other nor the linkage. While the mechanism moves, a name keeps its spot
// until it collides for a while. Names without a spot are left out, and shown at the pointer when it is on what they name.

import { distance } from "./geometry.js";
import { widthOf } from "./pen.js";
import { BUTTONS } from "./view.js";

const MOST = 80; // at once, the most important ones; more are unreadable, and those in view come with zooming in
const SPOTS = [[0.9, -0.9], [-0.9, -0.9], [0.9, 0.9], [-0.9, 0.9], [0, -1.2], [0, 1.2], [1.2, 0], [-1.2, 0]]; // around a place
const FACTORS = [1, 1.6, 2.4, 3.4]; // of the distance from it
const FAR = 0.15; // part of the motion for which a name may collide longer if it is nearer by one factor, or need not move
const LEADER = 10; // [px]; a line leads to a name that is further away
const CELL = 48; // [px] of the grid that finds what is in the way
const HALF = 8; // [px] of the height of a name
const CLOSER = 5; // [px] by which a name is closer to a line when it is next to it than when it is above it
const ABOVE = 30; // [px] of a name at the pointer, which a finger covers
export const PATIENCE = 300; // [ms] for which a name may collide before it leaves its spot, and for which it stays hidden

// What frames know of the spots of names.
//
// known: of the frames before, by name { spot, since, hidden }: spot: { id of a place, side, factor, worth } or { isInside, worth },
// undefined if the name was left out; since: time [ms] of the first of the last frames in which it collided, or was left out;
// hidden: time of the last frame in which it yielded.
// best: by name its spots, the best first; worth: for which part of the motion one is free, less for spots that are far.
export class Spots {
    constructor() {
        [this.known, this.best] = [new Map(), new Map()];
    }

    // Begin a frame at a time [ms]; with another scale or size of the view all names find new spots.
    begin(now, pose, view) {
        const state = `${view.scale} ${view.width} ${view.height}`;
        if (state !== this.state) this.known.clear();
        this.isMoving = pose !== this.pose;
        Object.assign(this, { now, pose, state, isWaiting: false });
    }

    // Find the best spots; frames: Names at poses of the motion, which want their names and know what is in the way.
    foresee(frames) {
        this.best.clear();
        const wanted = frames.map((names) => new Map(names.wanted.map((name) => [name.key, name])));
        for (const name of frames.flatMap((names) => names.wanted).sort((a, b) => a.rank - b.rank)) {
            if (this.best.has(name.key) || this.best.size >= MOST) continue;
            const spots = [];
            let most = 0;
            for (const spot of spotsOf(name)) {
                const loss = spot.isInside ? 0 : FAR * FACTORS.indexOf(spot.factor);
                if (most >= 1 - loss) break; // those that follow are not nearer
                spot.worth = frames.filter((names, k) => names.placeAt(wanted[k].get(name.key), spot, true)).length / frames.length - loss;
                most = Math.max(most, spot.worth);
                spots.push(spot);
            }
            spots.sort((a, b) => b.worth - a.worth);
            this.best.set(name.key, spots);
            frames.forEach((names, k) => names.take(names.placeAt(wanted[k].get(name.key), spots[0])));
        }
    }
}

export class Names {
    constructor(pen, view, theme, spots) {
        Object.assign(this, { pen, view, theme, spots });
        this.boxes = new Boxes(); // of names and pins
        this.yielding = new Boxes(); // of names that yield
        this.lines = new Boxes(); // of the linkage, loads and arrows
        [this.wanted, this.hidden, this.counts] = [[], [], new Map()];
    }

    // Want a name next to one of its places, the best first, at a distance `off`, or on the place `inside` of an area with
    // the colour `fill`; gap: how far a pixel is from what it names; yields: hidden while a more important one that yields
    // covers it. Names of a lower rank are more important. A place is a pixel, or { at, id, along } with the direction of
    // the line that it is on. Name and rank tell which name it is in the next frame, or a key in place of the name.
    add({ text, places, colour, off, rank, key = text, inside = null, fill = "", gap = null, yields = false }) {
        if (!text) return;
        const own = `${rank} ${key}`;
        const count = (this.counts.get(own) ?? 0) + 1; // of names with the same text
        this.counts.set(own, count);
        const all = places.map((place, id) => (Array.isArray(place) ? { at: place, id } : place));
        this.wanted.push({ text, places: all, colour, off, rank, inside, fill, gap, yields, key: `${own} ${count}`, width: widthOf(text) + 4 });
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
            const place = k < MOST && this.#kept(name);
            if (!place) {
                this.hidden.push(name);
                return;
            }
            this.take(place);
            if (name.yields) this.yielding.add(place.box);
            found.push({ ...place, name });
        });
        for (const { leader } of found) if (leader) this.pen.line(leader, { width: 0.8, colour: this.theme.quiet });
        for (const { box, name, spot } of found) {
            const halo = (spot.isInside && name.fill) || this.theme.paper;
            this.pen.text((box[0] + box[2]) / 2, (box[1] + box[3]) / 2, name.text, { colour: name.colour, size: 12, align: "center", halo });
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

    // Return where a name is drawn: where it was, unless it has collided there for a while. Then it moves to a spot that is
    // free and better for the rest of the motion, and when the mechanism rests, to any that is free.
    #kept(name) {
        const { known, best, now, isMoving } = this.spots;
        const before = known.get(name.key);
        const there = before?.spot && this.#at(name, before.spot);
        if (there && name.yields && !this.yielding.isFree(there.box)) before.hidden = now;
        const isHidden = now - before?.hidden < (isMoving ? PATIENCE : 1);
        const shown = isHidden ? null : there;
        if (isHidden) this.spots.isWaiting = true;
        if (there && this.#isClear(there)) {
            before.since = null;
            return shown;
        }
        const since = before ? before.since ?? now : -Infinity;
        if (before && now - since < PATIENCE) {
            before.since = since;
            this.spots.isWaiting = true;
            return shown;
        }
        let spots = best.get(name.key) ?? [];
        if (isMoving && before) spots = spots.filter(({ worth }) => worth > (before.spot?.worth ?? 0) + FAR);
        else spots = [...spots, ...spotsOf(name)];
        const spot = spots.find((one) => this.placeAt(name, one, true));
        if (!spot && isMoving) return shown;
        known.set(name.key, { spot, since: spot ? null : now });
        return spot ? this.placeAt(name, spot) : null;
    }

    // Return where a name is at a spot, null if this is no spot of the name, or if it is to be free and is not.
    placeAt(name, spot, isToBeFree = false) {
        const place = name && this.#at(name, spot);
        return place && (!isToBeFree || this.#isClear(place)) ? place : null;
    }

    // Keep other names off a place.
    take(place) {
        if (place) this.boxes.add(place.box);
    }

    // Return { spot, box, leader } of a name at a spot: a place by its id, a direction and a factor, or "inside".
    #at(name, spot) {
        const { width, off, inside } = name;
        const around = (cx, cy) => [cx - width / 2, cy - HALF, cx + width / 2, cy + HALF];
        if (spot.isInside) return inside && { spot, box: around(...inside), leader: null };
        const place = name.places.find(({ id }) => id === spot.id);
        if (!place) return null;
        const [x, y] = place.at;
        const far = off * spot.factor;
        if (place.along && !spot.isUpright) {
            const [nx, ny] = [-place.along[1] * spot.side, place.along[0] * spot.side];
            const gap = far - CLOSER + Math.abs(nx) * (width / 2) + Math.abs(ny) * CLOSER;
            const box = around(x + nx * gap, y + ny * gap);
            return { spot, box, leader: leaderTo(box, [x, y], off) };
        }
        const [dx, dy] = SPOTS[spot.side];
        const box = around(x + dx * far + (Math.sign(dx) * width) / 2, y + dy * far);
        return { spot, box, leader: leaderTo(box, [x, y], off) };
    }

    // Return whether a place is in the view, free, and its leader crosses no name and no pin.
    #isClear({ spot, box, leader }) {
        return this.#isIn(box) && this.isFree(box) && (!leader || this.#isOver(leader));
    }

    #isIn([left, top, right, bottom]) {
        return left >= 2 && right <= this.view.width - 2 && top >= BUTTONS + 10 && bottom <= this.view.height - 2;
    }

    #isOver([a, b]) {
        return [0.1, 0.3, 0.5, 0.7, 0.9].every((part) => {
            const [x, y] = [0, 1].map((axis) => a[axis] + part * (b[axis] - a[axis]));
            return this.boxes.isFree([x - 1, y - 1, x + 1, y + 1]);
        });
    }
}

// Yield the spots of a name, the best first.
function* spotsOf({ places, inside }) {
    if (inside) yield { isInside: true, worth: 0 };
    for (const factor of FACTORS) {
        for (const { id, along } of places) {
            const sides = along ? [1, -1] : SPOTS.keys();
            for (const side of sides) yield { id, side, factor, worth: 0 };
        }
    }
    for (const { id } of places.filter(({ along }) => along)) for (const side of SPOTS.keys()) yield { id, side, factor: FACTORS[2], isUpright: true, worth: 0 };
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
