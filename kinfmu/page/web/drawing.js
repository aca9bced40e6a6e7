// The drawing of a linkage: shapes, pins, names, curves, arrows, marks.

import { GREY, inkOf, LOOK, tint, widthOf } from "./pen.js";
import { distance, distanceToSegment, outline, placed, symbol } from "./geometry.js";
import { gravity, loads } from "./loads.js";
import { marks } from "./marks.js";
import { Names } from "./names.js";
import { grouped, niceStep, number } from "./numbers.js";
import { BUTTONS } from "./view.js";

// Draw a pose; show: what is switched on; view: from the plane to pixels; spots: of names in the frames before. Returns the
// handles { driver, body, at } of drivers, whether names have no place, and the lines { table, name, ends } of symbols.
export function draw(pen, linkage, view, theme, show, extra, spots) {
    const { pose } = linkage;
    linkage.pose = extra.pose ?? pose; // of values that do not close
    const painter = painted(pen, linkage, view, theme, show, extra, spots);
    if (show.names) {
        painter.names.draw();
        if (extra.pointer) painter.names.drawAt(extra.pointer.at, extra.pointer.reach);
    }
    linkage.pose = pose;
    return { handles: painter.handles, hasHidden: painter.names.hidden.length > 0, symbols: painter.symbols };
}

// Return the factor of the width of links, less than 1 if some are short compared with the linkage.
export function fineness(linkage) {
    const lengths = [];
    linkage.data.shapes.forEach((shape) => {
        const points = shape.kind === "link" ? shape.at : shape.kind === "bar" ? shape.between : [];
        points.slice(1).forEach((point, k) => lengths.push(distance(linkage.point(point), linkage.point(points[k]))));
    });
    const [x0, y0, x1, y1] = linkage.box();
    const size = Math.max(x1 - x0, y1 - y0);
    const shortest = Math.min(...lengths.filter((length) => length > 1e-3 * size), size);
    return Math.sqrt(Math.min(Math.max(shortest / (LOOK.longEnough * size), LOOK.finest ** 2), 1));
}

// Find the spots of names that are free at most poses of the motion.
export function foresee(linkage, view, theme, show, spots) {
    const frames = [];
    linkage.tour(() => frames.push(painted(NO_PEN, linkage, view, theme, show, NOTHING_MORE, spots).names));
    spots.foresee(frames);
}

const [UNIT, LEAST_UNIT] = [4 / 3, 0.95]; // [px] of a point of the table of strokes, less in small views
const NO_PEN = { line() {}, circle() {}, text() {} };
const NOTHING_MORE = { curves: [], arrows: [], legend: [], held: null, isGhost: false };

// Return the painter that has painted all but the names.
function painted(pen, linkage, view, theme, show, extra, spots) {
    const painter = new Painter(pen, linkage, view, theme, extra.isGhost, spots);
    painter.grid(show.grid);
    const strokes = painter.strokes(show);
    const [path] = LOOK.strokes.path;
    for (const one of strokes) if (one.stroke.order < path.order) painter.paint(one);
    if (show.curves) painter.curves(extra.curves);
    for (const one of strokes) if (one.stroke.order > path.order) painter.paint(one);
    painter.namesOfShapes();
    if (show.loads) loads(painter);
    painter.pins(extra.held);
    if (show.loads) gravity(painter);
    marks(painter, show, extra);
    for (const [at, radius] of extra.covered || []) painter.names.coverCircle(at, radius);
    return painter;
}

class Painter {
    constructor(pen, linkage, view, theme, isGhost, spots) {
        Object.assign(this, { pen, linkage, view, theme, isGhost });
        this.pose = linkage.pose;
        this.names = new Names(pen, view, theme, spots);
        [this.handles, this.symbols] = [[], []];
        this.fine = linkage.fineness;
        this.unit = Math.min(Math.max(Math.min(view.width, view.height) / LOOK.units, LEAST_UNIT), UNIT); // [px] of a point
        this.width = this.unit * LOOK.bar * this.fine; // of a link
        this.size = this.unit * (LOOK.always + (1 - LOOK.always) * this.fine); // of a unit of details
    }

    ink(colour) {
        return inkOf(this.isGhost ? GREY : colour, this.theme);
    }

    // Return how a stroke of a thing of a colour is painted.
    look({ line, fill, width = 0, of_link: ofLink = 0, dash }, colour) {
        const own = this.isGhost ? GREY : colour;
        return {
            width: Math.max(this.unit * width + ofLink * this.width, this.unit * LOOK.thinnest),
            colour: tint(line, own, this.theme),
            fill: fill ? tint(fill, own, this.theme) : null,
            dash: dash ? dash.map((length) => this.unit * length) : null,
        };
    }

    dot = (p) => this.view.pixel(p);

    all(...kinds) {
        return kinds.flatMap((kind) => this.linkage.shapesOf.get(kind) || []);
    }

    // Return the points of a shape in the plane; they move with the point next to which the file has the shape.
    at(shape, points = shape.points) {
        const { linkage, pose } = this;
        const [dx, dy] = this.moved(shape);
        if (shape.follows !== undefined) {
            const [x, y] = linkage.point(shape.follows);
            return points.map((p) => [x + p[0], y + p[1]]);
        }
        const frame = linkage.bodyPose(linkage.body(shape.frame), pose);
        return points.map((p) => placed(frame, p[0] + dx, p[1] + dy));
    }

    moved(shape) {
        if (shape.anchor === undefined) return [0, 0];
        const written = this.linkage.data.points[shape.anchor];
        const [x, y] = this.linkage.local(shape.anchor);
        return [x - written.x, y - written.y];
    }

    // Return a direction of a shape in pixels, y down.
    direction(shape) {
        const body = this.linkage.body(shape.axes ?? shape.frame);
        const phi = body < 0 ? 0 : this.linkage.bodyPose(body)[2];
        const [x, y] = placed([0, 0, phi], ...shape.direction);
        return [x, -y];
    }

    name(text, places, colour, off, rank, more = {}) {
        this.names.add({ text, places, colour, off, rank, ...more });
    }

    grid(isOn) {
        if (!isOn) return;
        const { view, pen, theme } = this;
        const step = niceStep(90 / view.scale);
        const [low, high] = [view.plane([0, view.height]), view.plane([view.width, 0])];
        for (let k = Math.ceil(low[0] / step); k * step <= high[0]; k++) {
            const [x] = this.dot([k * step, 0]);
            pen.line([[x, 0], [x, view.height]], { width: 1, colour: theme.grid });
            if (x < view.width - 60) this.scaleNumber(x + 3, view.height - 8, number(k * step));
        }
        for (let k = Math.ceil(low[1] / step); k * step <= high[1]; k++) {
            const [, y] = this.dot([0, k * step]);
            pen.line([[0, y], [view.width, y]], { width: 1, colour: theme.grid });
            if (y > BUTTONS + 20) this.scaleNumber(4, y - 7, number(k * step));
        }
        pen.text(view.width - 6, view.height - 8, this.linkage.data.unit, { colour: theme.quiet, size: 11, align: "right", halo: theme.paper });
    }

    scaleNumber(x, y, text) {
        this.pen.text(x, y, text, { colour: this.theme.quiet, size: 10, halo: this.theme.paper });
        this.names.boxes.add([x, y - 6, x + widthOf(text, 10), y + 6]);
    }

    // Draw paths of points: thin over the range, strong over the run.
    curves(curves) {
        const paint = (key, colour, points) => this.pen.line(points.map((p) => this.dot(p)), this.look(LOOK.strokes[key][0], colour));
        for (const { line, colour, isTrace } of curves) {
            const runs = isTrace ? [line] : runsOf(line);
            if (runs[0]?.length !== line.length) paint("range", colour, line);
            for (const run of runs) paint("path", colour, run);
        }
    }

    // ---- shapes

    // Return the strokes of shapes in the order in which they are painted, as strokes_of does in Python.
    strokes(show) {
        const { linkage } = this;
        const plates = new Set(linkage.shapes.filter((shape) => this.isPlate(shape)).map((shape) => shape.frame));
        const followers = new Set(linkage.data.cams.map((cam) => cam.follower));
        const ranks = new Map();
        const found = [];
        for (const shape of linkage.shapes) {
            if (!ranks.has(shape.frame)) ranks.set(shape.frame, ranks.size);
            if (shape.kind === "driver" && !show.limits) continue;
            for (const route of this.routes(shape, keyOf(shape, plates, followers))) {
                LOOK.strokes[route.key].forEach((stroke, layer) => found.push({ shape, route, stroke, place: [stroke.order, -(shape.radius || 0), ranks.get(shape.frame), layer] }));
            }
        }
        const compared = (a, b) => a[0] - b[0] || a[1] - b[1] || a[2] - b[2] || a[3] - b[3];
        return found.sort((a, b) => compared(a.place, b.place));
    }

    paint({ shape, route, stroke, place }) {
        const { points, centre, radius, closed } = route;
        const look = this.look(stroke, shape.colour);
        if (radius) this.pen.circle(...centre, radius, look);
        else this.pen.line(points, { ...look, closed });
        if (place[3]) return; // of one line the first stroke is the widest
        if (radius) this.names.coverCircle(centre, radius);
        else this.names.coverAll(points, look.width, closed);
    }

    isPlate(shape) {
        return shape.kind === "link" && this.outlines[this.linkage.body(shape.frame)].closed;
    }

    // Return the lines of a shape in pixels: { key, points, closed } or, of a circle, { key, centre, radius }.
    routes(shape, key) {
        if (shape.strips) {
            const base = this.base(shape);
            return shape.strips.map(({ points, stroke }) => {
                const own = stroke === shape.kind ? key : stroke;
                return { key: own, points: symbol(base, points, this.view.scale, this.size), closed: Boolean(LOOK.strokes[own][0].fill) };
            });
        }
        if (!key) return [];
        const [points, closed] = this.line(shape);
        if (shape.radius) return [{ key, centre: points[0], radius: shape.radius * this.view.scale }];
        const isBody = shape.kind === "link" || BARS.includes(shape.kind);
        for (const face of isBody ? this.all("face") : []) if (face.frame === shape.frame) this.offFace(face, points);
        return points.length > 1 ? [{ key, points, closed }] : [];
    }

    // Return the points of a shape in pixels, and whether they are a closed line.
    line(shape) {
        if (shape.between) return [shape.between.map((point) => this.dot(this.linkage.point(point))), false];
        if (shape.kind !== "link") return [this.at(shape).map((p) => this.dot(p)), Boolean(shape.closed)];
        const body = this.linkage.body(shape.frame);
        const { corners, closed } = this.outlines[body];
        const pose = this.linkage.bodyPose(body);
        return [corners.map((p) => this.dot(placed(pose, ...p))), closed];
    }

    // Return where the strips of a shape begin, the unit vector along them, and the distance of their ends [px], y down.
    base(shape) {
        const [start, end] = this.line(shape).flatMap((points) => points || []);
        const unit = (a, b) => [(b[0] - a[0]) / (distance(a, b) || 1), (b[1] - a[1]) / (distance(a, b) || 1)];
        if (shape.between) {
            const along = unit(start, end);
            const [from, to] = shape.points.map(([x]) => x * this.view.scale);
            const origin = shape.kind === "barrel" ? start : end;
            return { at: [0, 1].map((k) => origin[k] + from * along[k]), along, length: to - from };
        }
        if (!shape.direction) return { at: start, along: unit(start, end), length: distance(start, end) };
        const [x, y] = this.direction(shape);
        if (!end) return { at: start, along: [x, y], length: 0 };
        const length = (end[0] - start[0]) * y - (end[1] - start[1]) * x; // the direction is on the right of the line
        return { at: length < 0 ? end : start, along: [y, -x], length: Math.abs(length) };
    }

    // Move points of a body on the line of its flat face away from the cam, so that the edge of the body is the line.
    offFace(face, points) {
        const [a] = this.at(face).map((p) => this.dot(p));
        const away = this.direction(face);
        points.forEach((p, i) => {
            if (Math.abs((p[0] - a[0]) * away[0] + (p[1] - a[1]) * away[1]) < 0.1) points[i] = [0, 1].map((k) => p[k] + 0.5 * this.width * away[k]); // [px]
        });
    }

    // Want the names of bodies, bars, cylinders and faces.
    namesOfShapes() {
        const bars = grouped(this.all(...BARS), (bar) => bar.frame);
        for (const shape of this.all("link", "bar", "barrel", "face")) {
            const [points, closed] = this.line(shape);
            const own = shape.kind === "link" ? (bars.get(shape.frame) || []).map((bar) => ({ points: this.line(bar)[0], closed: false })) : [];
            const routes = points.length > 1 ? [{ points, closed }, ...own] : own;
            const gap = (p) => Math.min(...routes.flatMap((one) => sidesOf(one.points, one.closed).map((side) => distanceToSegment(p, ...side) - this.width / 2)));
            const [off, rank] = shape.kind === "link" ? [this.width / 2 + 8, 2] : [this.width / 3 + 8, 3];
            const ink = this.ink(shape.kind === "link" ? shape.colour : GREY);
            if (routes.length) this.name(shape.name, middlesOf(routes), ink, off, rank, { inside: closed ? centreOf(points) : null, fill: tint("fill", this.isGhost ? GREY : shape.colour, this.theme), gap });
            else this.name(shape.name, points, ink, 24, 3, { gap: (p) => distance(p, points[0]) - this.width });
        }
    }

    // Return for each point the first one that is always at the same place: of its body, or joined by a pin.
    get pinOf() {
        const { linkage } = this;
        if (linkage.pinsFor !== linkage.pose.locals) {
            linkage.pinsFor = linkage.pose.locals;
            const { points, joints } = linkage.data;
            const places = points.map((_, k) => `${linkage.bodyOf[k]} ${linkage.local(k)}`);
            const first = new Map(places.map((place, k) => [place, k]).reverse());
            linkage.pinList = places.map((place) => first.get(place));
            for (const { points: both } of joints.filter(({ type }) => type === "revolute")) {
                const [kept, other] = both.map((point) => linkage.pinList[point]).sort((a, b) => a - b);
                linkage.pinList = linkage.pinList.map((pin) => (pin === other ? kept : pin));
            }
        }
        return linkage.pinList;
    }

    get outlines() {
        const { linkage } = this;
        if (linkage.outlinesFor !== linkage.pose.locals) {
            linkage.outlinesFor = linkage.pose.locals;
            const ofBodies = grouped(linkage.bodyOf.keys(), (k) => linkage.bodyOf[k]);
            linkage.outlineList = linkage.bodies.map((_, body) => {
                const points = ofBodies.get(body) || [];
                return outline(points.length ? points.map((k) => linkage.local(k)) : [[0, 0]]);
            });
        }
        return linkage.outlineList;
    }

    // Draw pins and points, one at each place with the names of all that is there.
    pins(held) {
        const { joints, drivers, loads: efforts, interest, points } = this.linkage.data;
        const places = new Map(); // by number of the first point that is there
        const at = (point) => {
            const place = this.pinOf[point];
            if (!places.has(place)) places.set(place, { point, names: [], ends: [], key: "", colour: null });
            return places.get(place);
        };
        for (const { type, name, points: both } of joints) {
            if (!both || ["translational", "cam_flat_face"].includes(type)) continue;
            both.forEach((point, k) => {
                if (!k && SECOND_ONLY.includes(type)) return;
                const pin = at(point);
                pin.key = type === "fixed" && pin.key !== "pin" ? "weld" : "pin";
                if (type === "distance") pin.ends.push(points[point].name);
                else if (k === both.length - 1) pin.names.push(name);
            });
        }
        for (const { points: ends } of [...drivers.filter(({ type }) => type === "distance"), ...efforts.filter((one) => one.points.length > 1)]) {
            for (const point of ends) Object.assign(at(point), { key: "pin" }).ends.push(points[point].name);
        }
        for (const { name, point, colour } of interest) {
            const pin = at(point);
            Object.assign(pin, { colour }).names.push(name);
        }
        for (const { point, names, ends, key, colour } of places.values()) {
            const p = this.dot(this.linkage.point(point));
            if (key) this.dotAt(key, p, GREY);
            if (colour) this.dotAt("point", p, colour);
            const radius = LOOK.strokes[key || "point"][0].radius * this.width;
            this.names.boxes.add([p[0] - radius, p[1] - radius, p[0] + radius, p[1] + radius]);
            const text = [...new Set(names.length ? names : ends)].join(", ");
            const rank = colour ? 0 : names.length ? 1 : 4; // an end of a bar or cylinder, whose own name is at its middle
            this.name(text, [p], this.theme.ink, radius + 8, rank, { gap: (one) => distance(one, p) - radius, yields: true });
        }
        if (held) this.pen.circle(...this.dot(held), 0.33 * this.width + 6, { width: 2.5, colour: this.theme.accent });
    }

    dotAt(key, p, colour) {
        const [stroke] = LOOK.strokes[key];
        this.pen.circle(...p, stroke.radius * this.width, this.look(stroke, colour));
    }
}

const SECOND_ONLY = ["point_on_line", "cam_roller"]; // joints whose first point only says where a line or a cam is
const BARS = ["rod", "face"]; // lines of a body besides its link

// Return the row of the table of strokes for a shape that is a line; "" for what is not painted.
function keyOf({ kind, frame }, plates, followers) {
    if (kind === "link") return plates.has(frame) ? "plate" : "link";
    if (BARS.includes(kind)) return plates.has(frame) ? "arm" : "link";
    if (kind === "block" && followers.has(frame)) return "guide";
    return kind in LOOK.strokes ? kind : "";
}

// Return the parts of a path that are of the run.
function runsOf(line) {
    const runs = [[]];
    for (const point of line) {
        if (point[2]) runs[runs.length - 1].push(point);
        else if (runs[runs.length - 1].length) runs.push([]);
    }
    return runs;
}

function sidesOf(points, closed) {
    const ends = closed ? [...points, points[0]] : points;
    return ends.slice(1).map((b, k) => [ends[k], b]);
}

const PARTS = [0.5, 0.35, 0.65]; // of a line, where its name may be

// Return places for a name along lines, those of the longest line first.
function middlesOf(lines) {
    const sides = lines.flatMap(({ points, closed }) => sidesOf(points, closed)).map(([a, b], number) => ({ a, b, number, length: distance(a, b) }));
    sides.sort((p, q) => q.length - p.length);
    return sides.flatMap(({ a, b, number, length }) => {
        const along = [(b[0] - a[0]) / (length || 1), (b[1] - a[1]) / (length || 1)];
        return PARTS.map((part, k) => ({ at: [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])], id: PARTS.length * number + k, along }));
    });
}

function centreOf(points) {
    const sum = points.reduce(([x, y], p) => [x + p[0], y + p[1]], [0, 0]);
    return sum.map((value) => value / points.length);
}
