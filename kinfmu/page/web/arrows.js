// Arrows on the drawing: velocities and accelerations of points, forces in joints, shaking force.

import { number } from "./numbers.js";

const LONGEST = 0.22; // of the smaller side of the view
const SHORTEST = 0.3; // of the longest one, where arrows of points at the edge would leave the view
const EDGE = 8; // [px] between the head of an arrow and the edge of the view
const OUTLIERS = 2; // times the longest arrow: forces may grow without bound near singular poses
const COLOURS = {
    velocity: { light: [0, 120, 85], dark: [90, 200, 150] },
    acceleration: { light: [160, 50, 115], dark: [235, 150, 200] },
    force: { light: [180, 70, 0], dark: [255, 160, 90] },
    shaking: { light: [105, 65, 190], dark: [190, 160, 255] },
};

// Return arrows { from, along, colour, text } in pixels, and a legend { length, colour, text } of those to a fixed scale.
export function arrows({ linkage, show, view, drawn, theme }) {
    const longest = LONGEST * Math.min(view.width, view.height);
    const inTheme = (kind) => COLOURS[kind][theme.isDark ? "dark" : "light"];
    const { unit } = linkage.data;
    const found = [];
    const legend = [];
    const rates = [];
    if (show.velocity) rates.push(["velocity", "v", `${unit}/s`]);
    if (show.acceleration) rates.push(["acceleration", "a", `${unit}/s2`]);
    for (const [kind, which, of] of rates) {
        const vectors = movingPoints(linkage, drawn).map((k) => ({ at: linkage.point(k), v: linkage.motionOf(linkage.bodyOf[k], linkage.point(k))[which] }));
        const most = Math.max(...vectors.map(({ v }) => Math.hypot(...v)), 0);
        if (!(most > 0) || !Number.isFinite(most)) continue;
        const largest = vectors.find(({ v }) => Math.hypot(...v) === most);
        const whole = vectors.map(({ at, v }) => ({ from: at, along: v.map((x) => (x * longest) / most) }));
        const part = Math.max(Math.min(...whole.map((one) => partInView(view, one))), SHORTEST);
        whole.forEach(({ from, along }, k) => {
            const text = vectors[k] === largest ? `${number(most, 3)} ${of}` : "";
            found.push({ from, along: along.map((x) => x * part), colour: inTheme(kind), text });
        });
    }
    const wanted = [...(show.forces ? ["force"] : []), ...(show.shaking ? ["shaking"] : [])];
    for (const kind of linkage.part.reactions.length ? wanted : []) {
        const most = linkage.largestForce(kind, (pose) => forces(linkage, kind, pose).map(({ v }) => Math.hypot(...v)));
        if (!(most > 0)) continue;
        for (const { at, v } of forces(linkage, kind, linkage.pose)) {
            const scale = Math.min(longest / most, (OUTLIERS * longest) / Math.max(Math.hypot(...v), 1e-300));
            found.push({ from: at, along: v.map((x) => x * scale), colour: inTheme(kind), text: "" });
        }
        const newton = roundBelow(most);
        legend.push({ length: (newton * longest) / most, colour: inTheme(kind), text: `${number(newton, 3)} N ${kind === "force" ? "in joints" : "shaking force"}` });
    }
    return { found, legend };
}

// Return the part of an arrow that is in the view: 1 for all of it, or if it does not begin there.
function partInView(view, { from, along }) {
    const start = view.pixel(from);
    const size = [view.width, view.height];
    if (start.some((x, axis) => x < 0 || x > size[axis])) return 1;
    const moves = [along[0], -along[1]]; // pixels, y down
    const parts = moves.map((move, axis) => (move ? (move > 0 ? size[axis] - EDGE - start[axis] : start[axis] - EDGE) / Math.abs(move) : 1));
    return Math.min(1, ...parts);
}

function movingPoints(linkage, drawn) {
    const ofJoints = linkage.data.joints.flatMap((joint) => (joint.points || []).slice(-1));
    const places = [...new Set([...drawn.map((one) => one.point), ...ofJoints])];
    return places.filter((point) => linkage.triples[linkage.bodyOf[point]][0] >= 0);
}

// Return forces { at, v [N] } of a pose: in joints, of the first body on the second, or that on the ground at its origin.
function forces(linkage, kind, pose) {
    const reactions = pose.reactions();
    if (kind === "shaking") return [{ at: [0, 0], v: [reactions.get("shaking_force_x"), reactions.get("shaking_force_y")] }];
    const found = [];
    for (const { name, type, points, axis } of linkage.data.joints) {
        if (points?.length !== 2) continue;
        const [a, b] = points.map((point) => linkage.point(point, pose));
        const force = reactions.get(`${name}.force`);
        if (reactions.has(`${name}.force_x`)) found.push({ at: b, v: [reactions.get(`${name}.force_x`), reactions.get(`${name}.force_y`)] });
        else if (force === undefined) continue;
        else if (type === "distance") {
            const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
            found.push({ at: b, v: [(force * (b[0] - a[0])) / length, (force * (b[1] - a[1])) / length] });
        } else if (axis !== undefined) {
            const turn = (linkage.bound.get(`joints.${name}.axis`) ?? axis) + linkage.bodyPose(linkage.bodyOf[points[0]], pose)[2];
            found.push({ at: b, v: [-force * Math.sin(turn), force * Math.cos(turn)] });
        }
    }
    return found.filter(({ v }) => v.every(Number.isFinite));
}

// Return the largest of 1, 2, 5, 10, ... that is at most a value.
function roundBelow(value) {
    const tens = 10 ** Math.floor(Math.log10(value));
    return [5, 2, 1].find((digit) => digit * tens <= value) * tens || tens;
}
