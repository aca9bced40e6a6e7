// A mechanism as drawn, at its start pose: what the painter needs of a linkage, without an engine.

import { fineness } from "./drawing.js";
import { distance, outline, placed, seen } from "./geometry.js";
import { grouped } from "./numbers.js";
import { ONE_PIN } from "./editor_places.js";

export const EMPTY_BOX = [-50, -50, 190, 130]; // of a drawing without anything

export class Sketch {
    // locals: places of the points in their bodies, if they are not those of the data
    constructor(data, locals = data.points.map(({ x, y }) => [x, y])) {
        this.data = data;
        this.bodies = data.bodies.map((body) => body.name);
        this.numberOf = new Map(this.bodies.map((name, k) => [name, k]));
        this.bodyOf = data.points.map((point) => this.body(point.body));
        this.shapes = data.shapes;
        this.shapesOf = grouped(this.shapes, (shape) => shape.kind);
        [this.parameters, this.bound, this.part] = [[], new Map(), { reactions: [] }];
        const [x0, y0, x1, y1] = this.box();
        this.size = Math.hypot(x1 - x0, y1 - y0);
        this.#place(locals);
        this.fineness = fineness(this);
    }

    #place(locals) {
        this.pose = { locals: Float64Array.from(locals.flat()) };
        const { data } = this;
        this.pins = [];
        data.points.forEach((_, k) => {
            const at = this.point(k);
            const pin = this.pins.find((one) => distance(one.at, at) < ONE_PIN * this.size);
            if (pin) pin.points.push(k);
            else this.pins.push({ at, points: [k] });
        });
        const ends = (points) => points.map((k) => this.point(k));
        const members = (table, all) => all.filter(({ points }) => points?.length === 2).map(({ name, points }) => ({ table, name, ends: ends(points) }));
        this.lines = [
            ...this.bodies.flatMap((_, body) => this.#linesOf(body)),
            ...members("drivers", data.drivers.filter(({ type }) => type === "distance")),
            ...members("loads", data.loads),
            ...members("joints", data.joints.filter(({ type }) => type === "distance")),
        ];
        this.areas = [...this.bodies.flatMap((_, body) => this.#areasOf(body)), ...this.shapes.filter((shape) => shape.radius || shape.kind === "cam").map((shape) => this.#areaOf(shape))].filter(Boolean);
    }

    #outline(body) {
        const own = this.data.points.map((_, k) => k).filter((k) => this.bodyOf[k] === body);
        const found = outline(own.length ? own.map((k) => this.local(k)) : [[0, 0]]);
        const world = (p) => placed(this.bodyPose(body), ...p);
        return { ...found, corners: found.corners.map(world), ribs: found.ribs.map((rib) => rib.map(world)) };
    }

    #linesOf(body) {
        if (body === 0) return []; // the ground
        const { corners, closed, ribs } = this.#outline(body);
        const sides = corners.slice(1).map((b, k) => [corners[k], b]);
        if (closed) sides.push([corners[corners.length - 1], corners[0]]);
        return [...sides, ...ribs].map((ends) => ({ body: this.bodies[body], ends }));
    }

    #areasOf(body) {
        const { corners, closed } = this.#outline(body);
        return body > 0 && closed ? [{ body: this.bodies[body], contains: (p) => isInside(p, corners) }] : [];
    }

    #areaOf(shape) {
        const body = this.body(shape.frame);
        if (body <= 0) return null;
        const corners = shape.points.map((p) => placed(this.bodyPose(body), ...p));
        return { body: shape.frame, contains: (p) => (shape.radius ? distance(p, corners[0]) < shape.radius : isInside(p, corners)) };
    }

    body(name) {
        return this.numberOf.get(name) ?? -1;
    }

    bodyPose(body) {
        return this.data.bodies[body]?.pose || [0, 0, 0];
    }

    local(point) {
        return [this.pose.locals[2 * point], this.pose.locals[2 * point + 1]];
    }

    point(point) {
        return placed(this.bodyPose(this.bodyOf[point]), ...this.local(point));
    }

    nameOf(point) {
        const { body, name } = this.data.points[point];
        return `${body}.${name}`;
    }

    numberOfPoint(name) {
        return this.data.points.findIndex((_, k) => this.nameOf(k) === name);
    }

    box() {
        return this.data.box?.flat() || EMPTY_BOX;
    }

    // Return the box of all points, wheels and cams.
    extent() {
        const [x0, y0, x1, y1] = this.box();
        const round = this.shapes.filter(({ kind, radius }) => radius || kind === "cam");
        const places = round.flatMap(({ frame, points, radius = 0 }) => points.map((p) => placed(this.bodyPose(this.body(frame)), ...p)).flatMap(([x, y]) => [[x - radius, y - radius], [x + radius, y + radius]]));
        const [xs, ys] = [0, 1].map((axis) => places.map((p) => p[axis]));
        return [Math.min(x0, ...xs), Math.min(y0, ...ys), Math.max(x1, ...xs), Math.max(y1, ...ys)];
    }

    // Return the least number of the points that revolute joints hold together with a point.
    heldWith(point) {
        if (!this.held) {
            this.held = this.data.points.map((_, k) => k);
            for (const { type, points } of this.data.joints) {
                if (type !== "revolute" || !points) continue;
                const [a, b] = points.map((k) => this.held[k]).sort((x, y) => x - y);
                this.held = this.held.map((k) => (k === b ? a : k));
            }
        }
        return this.held[point];
    }

    // Return the numbers of the points that move with a point: those at its pin.
    movingWith(point) {
        return this.data.points.map((_, k) => k).filter((k) => this.heldWith(k) === this.heldWith(point));
    }

    // Return a sketch in which a pin is elsewhere.
    moved(point, to) {
        const own = this.movingWith(point);
        return new Sketch(this.data, this.data.points.map((_, k) => (own.includes(k) ? seen(this.bodyPose(this.bodyOf[k]), ...to) : this.local(k))));
    }

    // Return the places of the other points of bodies that keep their shape, of those with a point at a pin.
    placesKept(point, locked) {
        const own = this.movingWith(point);
        const bodies = own.map((k) => this.bodyOf[k]).filter((body) => locked.has(this.bodies[body]));
        return this.data.points.map((_, k) => k).filter((k) => bodies.includes(this.bodyOf[k]) && !own.includes(k)).map((k) => this.point(k));
    }
}

function isInside([x, y], corners) {
    let inside = false;
    corners.forEach((a, k) => {
        const b = corners[(k + 1) % corners.length];
        if (a[1] > y !== b[1] > y && x < a[0] + ((y - a[1]) * (b[0] - a[0])) / (b[1] - a[1])) inside = !inside;
    });
    return inside;
}
