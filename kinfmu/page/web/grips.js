// What the hand moves: driver values while a body is dragged, parameters while a pin is dragged in the mode for lengths.

import { CAMS } from "./forms.js";
import { distance, distanceToSegment, leastSquares, remainder, seen } from "./geometry.js";

const NO_EFFECT = 1e-5; // of the largest effect of a parameter on a pin; a smaller one is rounding

// Return what is at a place in the plane, within a reach: { body, local, point } or null.
export function gripAt(linkage, p, reach) {
    let best = null;
    let least = reach;
    linkage.data.points.forEach((_, point) => {
        const body = linkage.bodyOf[point];
        if (linkage.triples[body][0] < 0) return;
        const gap = distance(linkage.point(point), p);
        if (gap < least) {
            least = gap;
            best = { body, local: linkage.local(point), point };
        }
    });
    if (best) return best;
    for (const one of lines(linkage)) {
        const gap = distanceToSegment(p, ...one.ends);
        if (gap < least) {
            least = gap;
            best = { body: one.body, local: seen(linkage.bodyPose(one.body), ...p), point: null };
        }
    }
    if (best) return best;
    for (const shape of linkage.shapes) {
        const body = linkage.body(shape.frame);
        if (body < 0 || linkage.triples[body][0] < 0 || !(shape.radius || CAMS.includes(shape.kind))) continue;
        const local = seen(linkage.bodyPose(body), ...p);
        const [cx, cy] = shape.points.reduce(([x, y], q) => [x + q[0] / shape.points.length, y + q[1] / shape.points.length], [0, 0]);
        const radius = shape.radius || Math.max(...shape.points.map((q) => Math.hypot(q[0] - cx, q[1] - cy)));
        if (Math.hypot(local[0] - cx, local[1] - cy) <= radius) return { body, local, point: null };
    }
    return null;
}

// Return the handle of a driver that is at a place, as a grip of its body, and how far it is; null without one.
export function handleAt(linkage, view, handles, p, reach) {
    for (const { driver, body, at } of handles) {
        const centre = view.plane(at);
        const gap = distance(centre, p);
        if (gap < reach) return { driver, body, gap, local: seen(linkage.bodyPose(body), ...centre), point: null };
    }
    return null;
}

// Return the point of any body, the ground included, that is nearest to a place within a reach; null without one.
export function pinAt(linkage, p, reach) {
    let best = null;
    linkage.data.points.forEach((_, point) => {
        const gap = distance(linkage.point(point), p);
        if (gap < reach) [best, reach] = [point, gap];
    });
    return best;
}

function lines(linkage) {
    const found = [];
    linkage.bodies.forEach((_, body) => {
        if (linkage.triples[body][0] < 0) return;
        const own = linkage.data.points.map((__, k) => k).filter((k) => linkage.bodyOf[k] === body);
        own.forEach((a, i) => own.slice(i + 1).forEach((b) => found.push({ body, ends: [linkage.point(a), linkage.point(b)] })));
    });
    return found;
}

// Move drivers so that a gripped place comes near a target; return true if it reached a pose.
export function pull(linkage, grip, target) {
    const { drivers } = linkage.data;
    const k = grip.driver ?? drivers.findIndex((driver) => driver.kind === "angle" && driver.body === linkage.bodies[grip.body]);
    if (k >= 0 && drivers[k].pivot !== null) {
        const pivot = linkage.point(drivers[k].pivot);
        const now = place(linkage, grip);
        if (distance(now, pivot) > 0 && distance(target, pivot) > 0) {
            const turn = Math.atan2(target[1] - pivot[1], target[0] - pivot[0]) - Math.atan2(now[1] - pivot[1], now[0] - pivot[0]);
            const u = linkage.u.slice();
            u[k] += remainder(turn);
            return arrive(linkage, u);
        }
    }
    for (let step = 0; step < 6; step++) {
        const now = place(linkage, grip);
        const gap = [target[0] - now[0], target[1] - now[1]];
        if (Math.hypot(...gap) < 1e-6 * linkage.data.size) return true;
        const columns = drivers.map((_, i) => partial(linkage, grip, i));
        const rows = [0, 1].map((axis) => columns.map((column) => column[axis]));
        const scale = Math.max(...rows.flat().map(Math.abs));
        if (!(scale > 0)) return true;
        const du = leastSquares(rows, gap, 1e-4 * scale * scale);
        const most = Math.max(...du.map((d, i) => Math.abs(d) / (drivers[i].kind === "angle" ? 0.35 : 0.12 * linkage.data.size)), 1);
        const u = linkage.u.map((value, i) => value + du[i] / most);
        const before = distance(now, target);
        if (!arrive(linkage, u)) return false;
        if (distance(place(linkage, grip), target) >= before) break;
    }
    return true;
}

// Go to driver values, within the ranges of drivers that end at limits.
function arrive(linkage, u) {
    linkage.t = linkage.timeNear(u);
    return linkage.goTowards(u);
}

export function place(linkage, grip) {
    const pose = linkage.bodyPose(grip.body);
    const [c, s] = [Math.cos(pose[2]), Math.sin(pose[2])];
    return [pose[0] + c * grip.local[0] - s * grip.local[1], pose[1] + s * grip.local[0] + c * grip.local[1]];
}

// Return how a gripped place moves with one driver, per radian or length.
function partial(linkage, grip, driver) {
    const n = linkage.data.drivers.length;
    const ud = new Float64Array(n);
    ud[driver] = 1;
    linkage.shown.at(linkage.u, ud, new Float64Array(n));
    return linkage.motionOf(grip.body, place(linkage, grip), linkage.poseOf(linkage.shown)).v;
}

// Return names of the parameters on which the places of a pin in its bodies depend, without the locked ones.
export function parametersOf(linkage, design, point) {
    const at = linkage.point(point);
    const same = linkage.data.points.map((_, k) => k).filter((k) => distance(linkage.point(k), at) < 1e-6 * linkage.data.size);
    const places = new Set(same.map((k) => `${linkage.data.points[k].body}.${linkage.data.points[k].name}`));
    const found = linkage.parameters.filter((one) => !design.locked.has(one.name) && one.points?.some((name) => places.has(name)));
    return found.map((one) => one.name);
}

// Change parameters so that a pin comes near a target, by the smallest change; return true if a pose closes.
export function stretch(linkage, design, point, names, target) {
    if (!names.length) return true;
    const start = new Map(design.values);
    const step = 1e-6 * linkage.data.size;
    const grid = 10 ** Math.floor(Math.log10(linkage.data.size) - 3.5); // round values are easier to read and to make
    const decimals = Math.max(0, Math.ceil(-Math.log10(grid)));
    const unit = (name) => (design.byName.get(name).kind === "angle" ? step / linkage.data.size : step);
    for (let round = 0; round < 3; round++) {
        const now = linkage.point(point);
        const gap = [target[0] - now[0], target[1] - now[1]];
        if (Math.hypot(...gap) < grid) return true;
        const base = new Map(design.values);
        const columns = names.map((name) => {
            const moved = new Map(base).set(name, base.get(name) + unit(name));
            const p = linkage.setValues(moved) ? linkage.point(point) : now;
            return [(p[0] - now[0]) / step, (p[1] - now[1]) / step];
        });
        const sizes = columns.map((column) => Math.hypot(...column));
        const scale = Math.max(...sizes);
        for (let k = 0; k < names.length; k++) if (sizes[k] < NO_EFFECT * scale) columns[k].fill(0);
        const rows = [0, 1].map((axis) => columns.map((column) => column[axis]));
        linkage.setValues(base);
        if (!(scale > 1e-9)) return true;
        const change = leastSquares(rows, gap, 1e-5 * scale * scale);
        const most = Math.max(Math.hypot(...gap) / (0.1 * linkage.data.size), 1);
        const next = {};
        names.forEach((name, k) => {
            if (sizes[k] < NO_EFFECT * scale) return;
            const wanted = base.get(name) + (change[k] / most) * (unit(name) / step);
            next[name] = Number((Math.round(wanted / grid) * grid).toFixed(decimals));
        });
        if (!design.set(next)) {
            for (const [name, value] of round ? base : start) design.values.set(name, value);
            const failure = linkage.failure;
            design.set({});
            linkage.failure = failure;
            return false;
        }
    }
    return true;
}
