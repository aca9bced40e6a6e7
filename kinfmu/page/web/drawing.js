// The drawing of a linkage: shapes, pins, names, curves, arrows, marks.

import { edgeOf, fillOf, GREY, inkOf, paleOf, widthOf } from "./pen.js";
import { distance, distanceToSegment, isSlim, outline, placed } from "./geometry.js";
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

// Return a factor for the widths of lines, less than 1 if links are short compared with the linkage.
export function fineness(linkage) {
    const lengths = [];
    linkage.data.shapes.forEach((shape) => {
        const points = shape.between || (shape.kind === "link" ? shape.at : []);
        points.slice(1).forEach((point, k) => lengths.push(Math.hypot(...linkage.point(point).map((value, i) => value - linkage.point(points[k])[i]))));
    });
    const [x0, y0, x1, y1] = linkage.box();
    const size = Math.max(x1 - x0, y1 - y0);
    const shortest = Math.min(...lengths.filter((length) => length > 1e-3 * size), size);
    return Math.sqrt(Math.min(Math.max(shortest / (0.12 * size), 0.01), 1));
}

// Find the spots of names that are free at most poses of the motion.
export function foresee(linkage, view, theme, show, spots) {
    const frames = [];
    linkage.tour(() => frames.push(painted(NO_PEN, linkage, view, theme, show, NOTHING_MORE, spots).names));
    spots.foresee(frames);
}

const NO_PEN = { line() {}, circle() {}, text() {} };
const NOTHING_MORE = { curves: [], arrows: [], legend: [], held: null, isGhost: false };

// Return the painter that has painted all but the names.
function painted(pen, linkage, view, theme, show, extra, spots) {
    const painter = new Painter(pen, linkage, view, theme, extra.isGhost, spots);
    painter.grid(show.grid);
    painter.curves(extra.curves, show);
    painter.wheels();
    painter.ground();
    painter.links(true);
    painter.bars();
    painter.links(false);
    painter.racks();
    painter.slides();
    painter.cylinders();
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
        this.width = Math.max(4, Math.min(15, 13 * this.fine));
        this.size = Math.max(0.55, Math.min(1.15, 1.15 * this.fine));
    }

    edge(colour) {
        return this.isGhost ? edgeOf(GREY, this.theme) : edgeOf(colour, this.theme);
    }

    ink(colour) {
        return inkOf(this.isGhost ? GREY : colour, this.theme);
    }

    fill(colour) {
        return this.isGhost ? fillOf(GREY, this.theme) : fillOf(colour, this.theme);
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
        const body = this.linkage.body(shape.frame);
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

    curves(curves, show) {
        if (!show.curves) return;
        for (const { line, colour, isTrace } of curves) {
            const points = line.map((p) => this.dot(p));
            this.pen.line(points, { width: isTrace ? 2.5 : 1.6, colour: this.edge(colour), alpha: isTrace ? 0.9 : 0.75 });
        }
    }

    // ---- shapes

    // Larger wheels first; cams over the blocks of their followers, and the edge of the roller over both: it is often in the
    // middle of a block that is larger.
    wheels() {
        for (const shape of this.all("wheel").sort((a, b) => b.radius - a.radius)) this.circle(shape, { dash: [7, 3] });
        for (const shape of this.all("pitch")) this.pen.line(this.at(shape).map((p) => this.dot(p)), { width: 1.1, colour: this.edge(shape.colour), closed: true, dash: [9, 3, 2, 3] });
        for (const shape of this.all("roller")) this.circle(shape);
        const guides = this.all("block").filter((shape) => this.isOfFollower(shape));
        for (const shape of guides) this.block(shape);
        for (const shape of this.all("cam")) {
            const points = this.at(shape).map((p) => this.dot(p));
            this.pen.line(points, { ...this.area(shape), closed: true });
            this.names.coverAll(points, 1.5, true);
        }
        if (guides.length) for (const shape of this.all("roller")) this.circle(shape, { fill: null });
        for (const shape of this.all("spoke", "belt")) {
            this.pen.line(this.at(shape).map((p) => this.dot(p)), { width: 1.4, colour: this.edge(shape.colour) });
        }
    }

    area(shape) {
        return { width: 1.5, colour: this.edge(shape.colour), fill: this.isGhost ? null : paleOf(shape.colour, this.theme) };
    }

    circle(shape, style = {}) {
        const [centre] = this.at(shape).map((p) => this.dot(p));
        const radius = shape.radius * this.view.scale;
        this.pen.circle(...centre, radius, { ...this.area(shape), ...style });
        this.names.coverCircle(centre, radius);
    }

    isOfFollower(shape) {
        return this.linkage.data.cams.some((cam) => cam.follower === shape.frame);
    }

    // Racks are drawn over the links: a rack is often a link too.
    racks() {
        for (const rack of this.all("rack")) this.rack(rack);
    }

    rack(shape) {
        const [a, b] = this.at(shape).map((p) => this.dot(p));
        const [nx, ny] = this.direction(shape);
        const length = distance(a, b);
        const count = Math.max(Math.round(length / 11), 2);
        const along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
        const corners = [];
        for (let k = 0; k < count; k++) {
            for (const [part, depth] of [[0, 1], [0.25, 1], [0.4, -1], [0.6, -1], [0.75, 1]]) {
                const s = ((k + part) / count) * length;
                corners.push([a[0] + s * along[0] + 4 * depth * nx, a[1] + s * along[1] + 4 * depth * ny]);
            }
        }
        corners.push([b[0] + 4 * nx, b[1] + 4 * ny], [b[0] + 11 * nx, b[1] + 11 * ny], [a[0] + 11 * nx, a[1] + 11 * ny]);
        this.pen.line(corners, { width: 1.2, colour: this.edge(shape.colour), fill: this.fill(shape.colour), closed: true });
        this.names.coverAll(corners.slice(-4), 8, true);
    }

    ground() {
        const s = this.size;
        const colour = this.edge(GREY);
        for (const shape of this.all("support")) {
            const [p] = this.at(shape).map((one) => this.dot(one));
            const [dx, dy] = [shape.direction[0], -shape.direction[1]];
            const foot = [p[0] + 17 * s * dx, p[1] + 17 * s * dy];
            const along = [-dy * s, dx * s];
            const corner = (k) => [foot[0] + k * along[0], foot[1] + k * along[1]];
            this.pen.line([p, corner(-10), corner(10)], { width: 1.3, colour, fill: fillOf(GREY, this.theme), closed: true });
            this.hatched(corner(-15), corner(15), [dx, dy], colour);
            this.names.cover(p, foot, 12 * s);
        }
        for (const shape of this.all("rail", "bed")) {
            const [a, b] = this.at(shape).map((one) => this.dot(one));
            const [dx, dy] = [shape.direction[0], -shape.direction[1]];
            let along = [-dy, dx];
            if (along[0] * (b[0] - a[0]) + along[1] * (b[1] - a[1]) < 0) along = [dy, -dx];
            const lift = (shape.kind === "rail" ? 9 : 13) * s;
            const end = (p, sign) => [p[0] + lift * dx + sign * 25 * s * along[0], p[1] + lift * dy + sign * 25 * s * along[1]];
            this.hatched(end(a, -1), end(b, 1), [dx, dy], colour);
        }
    }

    hatched(a, b, [dx, dy], colour) {
        const length = distance(a, b);
        const along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
        const count = Math.min(Math.max(Math.floor(length / 6), 3), 400);
        for (let k = 0; k < count; k++) {
            const s = (length * (k + 0.8)) / count;
            const top = [a[0] + s * along[0], a[1] + s * along[1]];
            const depth = 6 * this.size;
            this.pen.line([top, [top[0] + depth * (dx - 0.8 * along[0]), top[1] + depth * (dy - 0.8 * along[1])]], { width: 0.9, colour });
        }
        this.pen.line([a, b], { width: 1.6, colour });
        this.names.cover(a, b, 4);
    }

    // Draw links: plates first, then those whose points are on a line, with their rods.
    links(areClosed) {
        const rods = grouped(this.all("rod"), (rod) => rod.frame);
        for (const link of this.all("link")) {
            const body = this.linkage.body(link.frame);
            const found = this.outlines[body];
            if (found.closed !== areClosed) continue;
            const pose = this.linkage.bodyPose(body);
            const place = (p) => this.dot(placed(pose, p[0], p[1]));
            const routes = found.corners.length > 1 ? [{ points: found.corners.map(place), closed: found.closed }] : [];
            for (const rod of rods.get(link.frame) || []) routes.push({ points: this.at(rod).map((p) => this.dot(p)), closed: false });
            const [edge, fill] = [this.edge(link.colour), this.fill(link.colour)];
            const width = this.width * (found.closed ? 0.8 : 1);
            for (const face of this.all("face")) if (face.frame === link.frame) this.face(face, routes, width);
            if (found.closed) this.pen.line(routes[0].points, { width: 0, fill: paleOf(this.isGhost ? GREY : link.colour, this.theme), closed: true, alpha: 0.85 });
            for (const { points, closed } of routes) this.pen.line(points, { width: width + 1.4, colour: edge, closed });
            for (const { points, closed } of routes) this.pen.line(points, { width: width - 1.4, colour: fill, closed });
            if (found.closed && isSlim(routes[0].points, width)) this.pen.line(routes[0].points, { width: 0, fill, closed: true });
            for (const { points, closed } of routes) this.names.coverAll(points, width, closed);
            for (const rib of found.ribs) {
                this.pen.line(rib.map(place), { width: width * 0.5, colour: fill });
                this.names.coverAll(rib.map(place), width * 0.5);
            }
            const middles = middlesOf(routes);
            const gap = (p) => Math.min(...routes.flatMap(({ points, closed }) => sidesOf(points, closed).map((side) => distanceToSegment(p, ...side) - width / 2)));
            const inside = found.closed ? centreOf(routes[0].points) : null;
            const first = place(found.corners[0] || [0, 0]);
            if (middles.length) this.name(link.name, middles, this.ink(link.colour), width / 2 + 8, 2, { inside, gap });
            else this.name(link.name, [first], this.ink(link.colour), 24, 3, { gap: (p) => distance(p, first) - width });
        }
    }

    // Add the line of a flat face to the routes of its body, all of a width on the side away from the cam, so that their
    // edge is the line.
    face(shape, routes, width) {
        const [a, b] = this.at(shape).map((p) => this.dot(p));
        const away = this.direction(shape);
        const isOn = (p) => Math.abs((p[0] - a[0]) * away[0] + (p[1] - a[1]) * away[1]) < 0.1; // [px]
        routes.push({ points: [a, b], closed: false });
        this.name(shape.name, middlesOf([{ points: [a, b], closed: false }]), this.theme.ink, width + 8, 3);
        for (const route of routes) route.points = route.points.map((p) => (isOn(p) ? [0, 1].map((k) => p[k] + 0.5 * width * away[k]) : p));
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

    bars() {
        for (const bar of this.all("bar")) {
            const points = bar.between.map((point) => this.dot(this.linkage.point(point)));
            const width = 0.5 * this.width;
            this.pen.line(points, { width: width + 1.2, colour: this.edge(GREY) });
            this.pen.line(points, { width: Math.max(width - 1, 1), colour: fillOf(GREY, this.theme) });
            this.names.cover(...points, width);
            this.name(bar.name, middlesOf([{ points, closed: false }]), this.ink(GREY), width / 2 + 8, 3, { gap: (p) => distanceToSegment(p, ...points) });
        }
    }

    slides() {
        for (const shape of this.all("slot", "block", "die")) {
            if (shape.kind === "slot") {
                const [a, b] = this.at(shape).map((p) => this.dot(p));
                const [edge, fill] = [this.edge(shape.colour), this.fill(shape.colour)];
                this.pen.line([a, b], { width: 1.55 * this.width + 1.4, colour: edge });
                this.pen.line([a, b], { width: 1.55 * this.width - 1.4, colour: fill });
                this.pen.line([a, b], { width: 0.75 * this.width + 1.2, colour: edge });
                this.pen.line([a, b], { width: 0.75 * this.width - 1.2, colour: this.theme.paper });
                this.names.cover(a, b, 1.55 * this.width);
            } else if (shape.kind === "die" || !this.isOfFollower(shape)) this.block(shape);
        }
    }

    block(shape) {
        const s = 1.2 * this.size;
        const [centre] = this.at(shape).map((p) => this.dot(p));
        const [x, y] = shape.kind === "die" ? [shape.direction[0], -shape.direction[1]] : this.direction(shape);
        const corner = (i, j) => [centre[0] + s * (13 * i * x - 8 * j * y), centre[1] + s * (13 * i * y + 8 * j * x)];
        const style = { width: 1.5, colour: this.edge(shape.colour), fill: this.fill(shape.colour), closed: true };
        this.pen.line([corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)], style);
        this.names.cover(corner(-0.4, 0), corner(0.4, 0), 16 * s);
    }

    cylinders() {
        const shafts = new Map(this.all("shaft").map((shape) => [shape.name, shape]));
        for (const barrel of this.all("barrel")) {
            const [a, b] = barrel.between.map((point) => this.dot(this.linkage.point(point)));
            const length = distance(a, b);
            const along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
            const tube = Math.min(barrel.points[1][0] * this.view.scale, 0.97 * length);
            const piston = Math.max(length + shafts.get(barrel.name).points[0][0] * this.view.scale, 5);
            const at = (d) => [a[0] + d * along[0], a[1] + d * along[1]];
            const w = this.width;
            this.pen.line([a, b], { width: 0.42 * w + 1.4, colour: this.edge(GREY), cap: "butt" });
            this.pen.line([a, b], { width: 0.42 * w - 0.8, colour: this.theme.paper, cap: "butt" });
            this.pen.line([at(4), at(tube)], { width: 1.15 * w + 1.4, colour: this.edge(GREY), cap: "butt" });
            this.pen.line([at(5), at(tube - 1)], { width: 1.15 * w - 1, colour: fillOf(GREY, this.theme), cap: "butt" });
            const disc = Math.min(Math.max(piston, 7), tube - 3);
            this.pen.line([at(disc - 1.6), at(disc + 1.6)], { width: 1.15 * w - 1, colour: this.edge(GREY), cap: "butt" });
            this.names.cover(a, b, 1.15 * w);
            this.name(barrel.name, [0.35, 0.6].map((part, id) => ({ at: at(part * length), id, along })), this.ink(GREY), 0.6 * w + 8, 3, { gap: (p) => distanceToSegment(p, a, b) });
        }
    }

    pins(held) {
        const { linkage, pen, theme } = this;
        const radius = Math.max(2.4, 0.33 * this.width);
        const [done, withName, named] = [new Set(), new Set(), new Set()]; // places of pins, those with names, names with places
        const isOfInterest = new Set(linkage.data.interest.map(({ point }) => point));
        const pin = (point, text, rank = 1) => {
            const p = this.dot(linkage.point(point));
            const place = this.pinOf[point];
            if (!done.has(place)) {
                done.add(place);
                pen.circle(...p, radius, { width: 1.6, colour: theme.ink, fill: theme.pin });
                this.names.boxes.add([p[0] - radius, p[1] - radius, p[0] + radius, p[1] + radius]);
            }
            if (text) {
                this.name(text, [p], theme.ink, radius + 8, rank, { gap: (one) => distance(one, p) - radius });
                withName.add(place);
            }
            named.add(`${text} ${place}`);
        };
        const end = (point) => { // of a bar, cylinder or spring, whose own name is at its middle
            const { name } = linkage.data.points[point];
            pin(point, withName.has(this.pinOf[point]) || isOfInterest.has(point) ? "" : name, 4);
        };
        const joints = linkage.data.joints.filter((joint) => joint.points && !["translational", "cam_flat_face"].includes(joint.type));
        const [bars, others] = [true, false].map((isBar) => joints.filter((joint) => (joint.type === "distance") === isBar));
        for (const { points, name } of others) points.forEach((point, k) => pin(point, k === points.length - 1 ? name : ""));
        for (const { points } of bars) points.forEach(end);
        for (const driver of linkage.data.drivers) if (driver.type === "distance") driver.points.forEach(end);
        for (const { points } of linkage.data.loads) if (points.length > 1) points.forEach(end);
        for (const { name, point, colour } of linkage.data.interest) {
            const p = this.dot(linkage.point(point));
            pen.circle(...p, radius + 0.6, { width: 1.6, colour: theme.ink, fill: this.edge(colour) });
            if (!done.has(this.pinOf[point])) this.names.boxes.add([p[0] - radius, p[1] - radius, p[0] + radius, p[1] + radius]);
            if (!named.has(`${name} ${this.pinOf[point]}`)) this.name(name, [p], theme.ink, radius + 8, 0, { gap: (one) => distance(one, p) - radius });
        }
        if (held) pen.circle(...this.dot(held), radius + 6, { width: 2.5, colour: theme.accent });
    }
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
