// Cams after a change of their numbers: pitch curve, profile, roller and flat face, as the follower touches the cam over a
// turn. Curves are in the cam's frame; z is the roller's centre or the point of the face, w the cam's rate against the
// follower, both over the driver:
//
//     roller: z - r n,  n = -i s z' / |z'|     s = 1 for a curve counter-clockwise
//     face:   z + c t,  c = -z'.n / w          n: outward normal of the face, t = i n

import { isGood } from "./engine.js";
import { TURN, length, placed, seen } from "./geometry.js";

const ANGLES = 360; // points of a curve
const CLOSED = 1e-6; // of the size, and of a radian: largest gap after a turn
const ROUNDING = 1e-9; // of the radius of a roller
const OVERHANG = 0.15; // of the contact's range, by which a flat face is longer on either side
const ROLLER_GREY = [150, 150, 150]; // as in kinfmu/draw/scene/palette.py
export const OF_CAMS = ["cam", "pitch", "roller", "face"]; // kinds of shapes

// Return whether a number of a joint is not that of the file.
export function isJointChanged(linkage, name) {
    const joint = linkage.data.joints.find((one) => one.name === name);
    return changed(linkage).some((one) => one.name.startsWith(`joints.${name}.`) || joint?.numbers?.includes(one.name));
}

function changed(linkage) {
    return linkage.parameters.filter((one) => !one.isLaw && linkage.bound.get(one.name) !== one.value);
}

// Return the cams to draw again, with their shapes, and in words what is left out: { name, shapes, leftOut }.
export function camsOf(linkage) {
    return linkage.data.cams.filter((cam) => isOther(linkage, cam)).map((cam) => ({ name: cam.name, ...camOf(linkage, cam) }));
}

// Return whether a changed number may enter the shapes of a cam: a given curve depends on its own numbers only.
function isOther(linkage, cam) {
    if (cam.joints.some((name) => isJointChanged(linkage, name))) return true;
    return changed(linkage).some((one) => one.points.some((point) => cam.bodies.includes(point.split(".")[0])));
}

function camOf(linkage, cam) {
    const [radius, normal] = [numberOf(linkage, cam, "roller_radius"), numberOf(linkage, cam, "normal")];
    const unknown = normal === undefined ? "the direction of whose face follows from an expression" : "";
    const turn = unknown ? null : turnOf(linkage, cam, normal);
    if (!turn) return { shapes: [], leftOut: `the cam of joint ${cam.name}, ${unknown || "which no driver turns all the way round"}` };
    const { points, sense } = turn;
    const colour = (body) => linkage.data.bodies[linkage.body(body)].colour;
    const curve = (kind, line) => ({ kind, name: cam.name, frame: cam.body, colour: colour(cam.body), points: line, closed: true });
    if (normal !== null) {
        const touching = points.map(({ z, n, c }) => [z[0] - c * n[1], z[1] + c * n[0]]);
        const face = { kind: "face", name: cam.name, frame: cam.follower, colour: colour(cam.follower), ...faceOf(linkage, cam, normal, points, touching) };
        const isReal = isConvex(points, touching, sense, linkage.local(cam.centre));
        return isReal ? { shapes: [curve("cam", touching), face], leftOut: "" } : { shapes: [face], leftOut: `the profile of joint ${cam.name}, which would not be convex` };
    }
    const pitch = curve("pitch", points.map(({ z }) => z));
    if (radius === null) return { shapes: [pitch], leftOut: "" };
    if (radius === undefined) return { shapes: [pitch], leftOut: `the profile of joint ${cam.name}, whose roller follows from an expression` };
    const profile = profileOf(points, sense, radius, linkage.local(cam.centre));
    if (!profile) return { shapes: [pitch], leftOut: `the profile of joint ${cam.name}, into which its roller cuts` };
    const roller = { kind: "roller", name: cam.name, frame: cam.follower, colour: ROLLER_GREY, points: [linkage.local(cam.point)], radius };
    return { shapes: [pitch, curve("cam", profile), ...(radius > 0 ? [roller] : [])], leftOut: "" };
}

// Return a number of a cam's joint: null if the file has none, undefined if an expression of changed parameters gives it.
function numberOf(linkage, cam, key) {
    return valueOf(linkage, `joints.${cam.name}.${key}`, cam[key] || { value: null, names: [] });
}

// Return a number of the file as set, by its place; undefined if an expression of changed parameters gives it.
export function valueOf(linkage, name, { value, names, alone }) {
    const place = linkage.bound.get(name);
    if (place !== undefined) return place;
    if (alone) return linkage.bound.get(alone) ?? value;
    return changed(linkage).some((one) => names.includes(one.name)) ? undefined : value;
}

// Return what the follower does in the cam's frame over a turn of the cam, { points: [{ z, z1, w, n, c }], sense }; null if
// no driver turns the cam all the way round and in one direction.
function turnOf(linkage, cam, normal) {
    const { drivers } = linkage.data;
    const own = drivers.findIndex((driver) => driver.kind === "angle" && driver.body === cam.body);
    const k = own < 0 && drivers.length === 1 && drivers[0].kind === "angle" ? 0 : own;
    if (k < 0) return null;
    let found = around(linkage, cam, normal, k, TURN);
    const turn = found && Math.abs(found.turn);
    if (found && turn > CLOSED && Math.abs(turn - TURN) > CLOSED) found = around(linkage, cam, normal, k, (TURN * TURN) / turn); // behind gears
    if (!found || Math.abs(Math.abs(found.turn) - TURN) > CLOSED) return null;
    const { points } = found;
    const last = points.pop();
    const isClosed = length(last.z[0] - points[0].z[0], last.z[1] - points[0].z[1]) < CLOSED * linkage.data.size;
    const isOneWay = points.every(({ w }) => w * found.turn > 0);
    return isClosed && isOneWay ? { points, sense: -Math.sign(found.turn) } : null;
}

function around(linkage, cam, normal, k, span) {
    const { probe } = linkage;
    const u = Float64Array.from(linkage.law[0].u);
    const [from, ud, udd] = [u[k], new Float64Array(u.length), new Float64Array(u.length)];
    ud[k] = 1;
    probe.restart();
    const points = [];
    for (let i = 0; i <= ANGLES; i++) {
        u[k] = from + (span * i) / ANGLES;
        if (!isGood(probe.at(u, ud, udd))) return null;
        points.push(touchOf(linkage, cam, normal, linkage.poseOf(probe)));
    }
    return { points, turn: points[ANGLES].angle - points[0].angle };
}

// Return the follower in the cam's frame at a pose, with rates over the driver.
function touchOf(linkage, cam, normal, pose) {
    const [body, follower] = [cam.body, cam.follower].map((name) => linkage.body(name));
    const rate = (k) => (pose.triples[k][0] < 0 ? 0 : pose.qd[pose.triples[k][2]]);
    const [frame, p] = [linkage.bodyPose(body, pose), linkage.point(cam.point, pose)];
    const [own, other] = [linkage.motionOf(follower, p, pose), linkage.motionOf(body, p, pose)];
    const v = [own.v[0] - other.v[0], own.v[1] - other.v[1]];
    const [z, z1] = [seen(frame, ...p), placed([0, 0, -frame[2]], ...v)];
    const w = rate(body) - rate(follower);
    const angle = frame[2] - linkage.bodyPose(follower, pose)[2];
    const n = placed([0, 0, (normal ?? 0) - angle], 1, 0);
    return { z, z1, w, angle, n, c: -(z1[0] * n[0] + z1[1] * n[1]) / w };
}

// Return the profile under a roller; null if the roller would cut into it, from its own place or from another one.
function profileOf(points, sense, radius, [cx, cy]) {
    const line = points.map(({ z, z1 }) => {
        const part = (radius * sense) / length(...z1);
        return [z[0] - part * z1[1], z[1] + part * z1[0]];
    });
    const isFree = (p) => points.every(({ z }) => length(p[0] - z[0], p[1] - z[1]) >= radius * (1 - ROUNDING));
    const isReal = line.every(isFree) && (radius === 0 || points.every(({ z }) => length(z[0] - cx, z[1] - cy) > radius));
    return isReal ? line : null;
}

// Return whether the profile under a flat face is convex around its centre, as it must be.
function isConvex(points, touching, sense, [cx, cy]) {
    return points.every(({ n }, k) => {
        const [a, b] = [touching[k], touching[(k + 1) % touching.length]];
        const other = points[(k + 1) % points.length].n;
        const along = [-n[1] - other[1], n[0] + other[0]];
        return sense * ((b[0] - a[0]) * along[0] + (b[1] - a[1]) * along[1]) > 0 && (a[0] - cx) * n[0] + (a[1] - cy) * n[1] > 0;
    });
}

// Return the line of a flat face in the follower's frame: as far as the contact reaches, and a little more.
function faceOf(linkage, cam, normal, points, touching) {
    const places = points.map(({ c }) => c);
    const [low, high] = [Math.min(...places), Math.max(...places)];
    const [cx, cy] = linkage.local(cam.centre);
    const more = OVERHANG * Math.max(high - low, ...touching.map(([x, y]) => length(x - cx, y - cy)));
    const [x, y] = linkage.local(cam.point);
    const direction = [Math.cos(normal), Math.sin(normal)];
    return { points: [low - more, high + more].map((c) => [x - c * direction[1], y + c * direction[0]]), direction };
}
