// Shapes after a change of lengths: slides, wheels, racks, cams and cylinders follow; what the page cannot know is left out.

import { camsOf, isJointChanged, OF_CAMS } from "./cams.js";
import { distance, placed, seen } from "./geometry.js";
import { loadsLeftOut } from "./loads.js";

const POSES = 120; // that decide how far slides reach
const BEYOND = 0.35; // of the pinion's radius, additional length at both ends of a rack
const OF_SHORTEST = 0.9; // of the shortest length of a cylinder, its longest barrel; the rod stays in it by the rest
export const CAMS = ["cam", "pitch"]; // closed curves of a cam: its profile, and the path of the roller's centre on it
const OF_JOINTS = ["wheel", "spoke", "belt", "rack"]; // whose size follows from numbers of their joint

// Return the shapes to draw with the lengths as set, those of the file if none is changed, and in words what is left out.
export function formsOf(linkage) {
    const { shapes } = linkage.data;
    if (!linkage.isChanged) return { shapes, leftOut: [] };
    const tracks = tracksOf(linkage, shapes);
    const cams = camsOf(linkage);
    const unknown = shapes.filter((shape) => OF_JOINTS.includes(shape.kind) && isJointChanged(linkage, shape.name));
    const isKept = (shape) => !unknown.includes(shape) && !(OF_CAMS.includes(shape.kind) && cams.some(({ name }) => name === shape.name));
    const kept = shapes.filter(isKept).map((shape) => {
        if (shape.line) return ofSlide(linkage, shape, tracks.get(shape));
        if (shape.kind === "rack") return ofRack(linkage, shape, tracks.get(shape));
        if (shape.kind === "wheel" || shape.kind === "spoke") return scaled(shape, growth(linkage, shape.name));
        if (shape.kind === "belt") return ofBelt(linkage, shape);
        if (shape.kind === "barrel" || shape.kind === "shaft") return ofCylinder(linkage, shape);
        return shape;
    });
    const wheels = [...new Set(unknown.map(({ name }) => name))].map((name) => `the wheels of ${name}, whose numbers are changed`);
    return {
        shapes: [...kept, ...cams.flatMap((cam) => cam.shapes)],
        leftOut: [...wheels, ...cams.map((cam) => cam.leftOut).filter(Boolean), ...loadsLeftOut(linkage)],
    };
}

// Return for each shape that depends on a path the places of its point in the frame of its holder, over the range.
function tracksOf(linkage, shapes) {
    const wanted = new Map();
    for (const shape of shapes) {
        if (shape.line) wanted.set(shape, { point: shape.line.point, holder: shape.line.holder });
        if (shape.kind === "rack") wanted.set(shape, { point: wheelsOf(linkage, shape.name)[0].anchor, holder: shape.frame });
    }
    const found = new Map([...wanted.keys()].map((shape) => [shape, []]));
    if (!wanted.size) return found;
    linkage.visit(linkage.data.drivers.length === 1 ? "driver" : "time", POSES, (_, pose) => {
        if (!pose) return;
        for (const [shape, { point, holder }] of wanted) {
            found.get(shape).push(seen(linkage.bodyPose(linkage.body(holder), pose), ...linkage.point(point, pose)));
        }
    });
    return found;
}

// Return the unit vector and the ends of a straight track, with the places of other points of its line; null without one.
function lineOf(linkage, track, others = []) {
    if (!track.length) return null;
    const [first] = track;
    const far = track.reduce((best, p) => (distance(p, first) > distance(best, first) ? p : best));
    const length = distance(far, first);
    if (!(length > 1e-9 * linkage.data.size)) return null;
    const along = [(far[0] - first[0]) / length, (far[1] - first[1]) / length];
    const parts = [...track, ...others].map((p) => (p[0] - first[0]) * along[0] + (p[1] - first[1]) * along[1]);
    const at = (part) => [first[0] + part * along[0], first[1] + part * along[1]];
    return { along, ends: [at(Math.min(...parts)), at(Math.max(...parts))] };
}

function ofSlide(linkage, shape, track) {
    const { origin, holder } = shape.line;
    const line = lineOf(linkage, track, shape.kind === "rod" && origin !== null ? [linkage.local(origin)] : []);
    if (!line) return shape;
    const { along, ends } = line;
    if (shape.kind === "slot" || shape.kind === "rod") return { ...shape, points: ends, anchor: undefined };
    if (shape.kind === "die") return { ...shape, direction: along };
    if (shape.kind === "block") {
        const turn = linkage.bodyPose(linkage.body(holder))[2] - linkage.bodyPose(linkage.body(shape.frame))[2];
        return { ...shape, direction: placed([0, 0, turn], ...along) };
    }
    const side = -along[1] * shape.direction[0] + along[0] * shape.direction[1] < 0 ? -1 : 1;
    return { ...shape, points: ends, direction: [-side * along[1], side * along[0]], anchor: undefined };
}

function ofRack(linkage, shape, track) {
    const [a, b] = shape.points;
    const length = distance(a, b);
    const along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    const parts = track.map(([x, y]) => x * along[0] + y * along[1]);
    const [{ radius }] = wheelsOf(linkage, shape.name);
    const across = track[0][0] * shape.direction[0] + track[0][1] * shape.direction[1] + radius;
    const at = (part) => [part * along[0] + across * shape.direction[0], part * along[1] + across * shape.direction[1]];
    return { ...shape, points: [at(Math.min(...parts) - BEYOND * radius), at(Math.max(...parts) + BEYOND * radius)], anchor: undefined };
}

function wheelsOf(linkage, joint) {
    return linkage.data.shapes.filter((shape) => shape.kind === "wheel" && shape.name === joint);
}

// Return by which factor the wheels of a joint are larger than in the file: that of the distance of their axles.
function growth(linkage, joint) {
    const wheels = wheelsOf(linkage, joint);
    if (wheels.length < 2) return 1;
    const [a, b] = wheels.map((wheel) => linkage.point(wheel.anchor));
    return distance(a, b) / linkage.axles.get(joint);
}

// Return the distances of the axles of wheels, by joint.
export function axlesOf(linkage) {
    const pairs = new Map();
    for (const { kind, name, anchor } of linkage.data.shapes) if (kind === "wheel") pairs.set(name, [...(pairs.get(name) || []), anchor]);
    return new Map([...pairs].filter(([, anchors]) => anchors.length === 2).map(([name, [a, b]]) => [name, distance(linkage.point(a), linkage.point(b))]));
}

function scaled(shape, factor) {
    const [[x, y]] = shape.points;
    const points = shape.points.map((p) => [x + factor * (p[0] - x), y + factor * (p[1] - y)]);
    return { ...shape, points, radius: shape.radius && factor * shape.radius };
}

// Return one of the two straight parts of a belt around two pulleys.
function ofBelt(linkage, shape) {
    const both = linkage.data.shapes.filter((one) => one.kind === "belt" && one.name === shape.name);
    const carrier = linkage.bodyPose(linkage.body(shape.frame));
    const wheels = wheelsOf(linkage, shape.name);
    const [a, b] = wheels.map((wheel) => seen(carrier, ...linkage.point(wheel.anchor)));
    const [r, s] = wheels.map((wheel) => wheel.radius * growth(linkage, shape.name));
    const lean = Math.acos((r - s) / distance(a, b)) * (both.indexOf(shape) ? -1 : 1);
    const angle = Math.atan2(b[1] - a[1], b[0] - a[0]) + lean;
    const off = [Math.cos(angle), Math.sin(angle)];
    return { ...shape, points: [[a[0] + r * off[0], a[1] + r * off[1]], [b[0] + s * off[0], b[1] + s * off[1]]], anchor: undefined };
}

function ofCylinder(linkage, shape) {
    const k = linkage.data.drivers.findIndex((driver) => driver.name === shape.name);
    const barrel = linkage.data.shapes.find((one) => one.kind === "barrel" && one.name === shape.name);
    const [shortest, longest] = linkage.ranges[k];
    const tube = Math.min(barrel.points[1][0], OF_SHORTEST * shortest);
    if (shape.kind === "barrel") return { ...shape, points: [[0, 0], [tube, 0]] };
    return { ...shape, points: [[-Math.max(longest - OF_SHORTEST * tube, 0), 0], [0, 0]] };
}
