// Arrows on the drawing: velocities, accelerations and forces.

import { number } from "./numbers.js";

const LONGEST = 0.22; // of the smaller side of the view

// Return arrows in pixels: velocities, accelerations and forces, each kind to its own scale.
export function arrows({ linkage, show, view, drawn }) {
    const longest = LONGEST * Math.min(view.width, view.height);
    const places = [...new Set([...drawn.map((one) => one.point), ...linkage.data.joints.flatMap((joint) => (joint.points || []).slice(-1))])];
    const moving = places.filter((point) => linkage.triples[linkage.bodyOf[point]][0] >= 0);
    const found = [];
    const add = (vectors, colour, unit) => {
        const most = Math.max(...vectors.map(({ v }) => Math.hypot(...v)), 0);
        if (!(most > 0) || !Number.isFinite(most)) return;
        const largest = vectors.find(({ v }) => Math.hypot(...v) === most);
        for (const one of vectors) found.push({ from: one.at, along: one.v.map((x) => (x * longest) / most), colour, text: one === largest ? `${number(most, 3)} ${unit}` : "" });
    };
    const unit = linkage.data.unit;
    if (show.velocity) add(moving.map((k) => ({ at: linkage.point(k), v: linkage.motionOf(linkage.bodyOf[k], linkage.point(k)).v })), (theme) => (theme.isDark ? [90, 200, 150] : [0, 120, 85]), `${unit}/s`);
    if (show.acceleration) add(moving.map((k) => ({ at: linkage.point(k), v: linkage.motionOf(linkage.bodyOf[k], linkage.point(k)).a })), (theme) => (theme.isDark ? [235, 150, 200] : [160, 50, 115]), `${unit}/s2`);
    if (show.forces && linkage.pose.forces) add(forces(linkage), (theme) => (theme.isDark ? [255, 160, 90] : [180, 70, 0]), "N");
    return found;
}

function forces(linkage) {
    const at = new Map(linkage.part.forces.map(({ name }, k) => [name, linkage.pose.forces[k]]));
    const found = [];
    for (const joint of linkage.data.joints) {
        if (!joint.points) continue;
        const p = linkage.point(joint.points[joint.points.length - 1]);
        if (at.has(`${joint.name}.force_x`)) found.push({ at: p, v: [at.get(`${joint.name}.force_x`), at.get(`${joint.name}.force_y`)] });
        else if (at.has(`${joint.name}.force`)) {
            const force = at.get(`${joint.name}.force`);
            const [a, b] = joint.points.map((point) => linkage.point(point));
            const turn = joint.axis === undefined ? Math.atan2(b[1] - a[1], b[0] - a[0]) : joint.axis + linkage.bodyPose(linkage.bodyOf[joint.points[0]])[2] + Math.PI / 2;
            found.push({ at: p, v: [force * Math.cos(turn), force * Math.sin(turn)] });
        }
    }
    return found.filter(({ v }) => v.every(Number.isFinite));
}
