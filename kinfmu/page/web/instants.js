// Quantities of a pose that are drawn: transmission angles and instant centres.

// Return transmission angles [rad] of the loops, with the place of the pin.
export function transmissions(linkage, pose = linkage.pose) {
    return linkage.data.loops.map((loop) => {
        const pins = loop.pins.map((pin) => linkage.point(pin, pose));
        if (loop.direction !== undefined) {
            const [p, s] = pins;
            const length = Math.hypot(s[0] - p[0], s[1] - p[1]);
            const normal = [-Math.sin(loop.direction), Math.cos(loop.direction)];
            const cosine = (normal[0] * (s[0] - p[0]) + normal[1] * (s[1] - p[1])) / length;
            const arms = [[p[0] - s[0], p[1] - s[1]], [-normal[0], -normal[1]]];
            return { loop, angle: Math.acos(Math.max(-1, Math.min(1, cosine))), at: s, arms };
        }
        const [p, q, c] = pins;
        const arms = [[p[0] - q[0], p[1] - q[1]], [c[0] - q[0], c[1] - q[1]]];
        const [[ax, ay], [bx, by]] = arms;
        return { loop, angle: Math.abs(Math.atan2(ax * by - ay * bx, ax * bx + ay * by)), at: q, arms };
    });
}

// Return instant centres of moving bodies relative to the ground, and of all pairs of up to four bodies.
export function centres(linkage, pose = linkage.pose) {
    const twists = linkage.bodies.map((name, body) => {
        const { v } = linkage.motionOf(body, [0, 0], pose);
        const iphi = pose.triples[body][2];
        return { name, omega: iphi < 0 ? 0 : pose.qd[iphi], v };
    });
    const found = [];
    const fastest = Math.max(...twists.map((twist) => Math.abs(twist.omega)));
    for (let i = 0; i < twists.length; i++) {
        for (let j = i + 1; j < twists.length; j++) {
            if (i > 0 && twists.length > 4) continue;
            const omega = twists[j].omega - twists[i].omega;
            if (Math.abs(omega) <= 1e-6 * fastest) continue;
            const v = [twists[j].v[0] - twists[i].v[0], twists[j].v[1] - twists[i].v[1]];
            found.push({ at: [-v[1] / omega, v[0] / omega], label: `${i + 1}${twists.length > 9 ? "," : ""}${j + 1}` });
        }
    }
    return found;
}
