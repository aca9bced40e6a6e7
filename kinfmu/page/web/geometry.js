// Plane geometry: points in frames, outlines of links.

export const TURN = 2 * Math.PI;

export function placed(pose, x, y) {
    const c = Math.cos(pose[2]);
    const s = Math.sin(pose[2]);
    return [pose[0] + c * x - s * y, pose[1] + s * x + c * y];
}

export function seen(pose, x, y) {
    const c = Math.cos(pose[2]);
    const s = Math.sin(pose[2]);
    const dx = x - pose[0];
    const dy = y - pose[1];
    return [c * dx + s * dy, c * dy - s * dx];
}

export function distance(a, b) {
    return length(a[0] - b[0], a[1] - b[1]);
}

// Return the length of a vector; Math.hypot is many times slower.
export function length(x, y) {
    return Math.sqrt(x * x + y * y);
}

export function remainder(angle) {
    return angle - TURN * Math.round(angle / TURN);
}

// Return the distance of a point from a straight line between two points.
export function distanceToSegment(p, a, b) {
    const dx = b[0] - a[0];
    const dy = b[1] - a[1];
    const length = dx * dx + dy * dy;
    const part = length > 0 ? Math.min(1, Math.max(0, ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length)) : 0;
    return Math.hypot(p[0] - a[0] - part * dx, p[1] - a[1] - part * dy);
}

// Return the corners of a link with these points, whether they enclose an area, and lines to the points inside.
export function outline(points) {
    const kept = [];
    for (const point of points) if (!kept.some((other) => distance(point, other) === 0)) kept.push(point);
    if (kept.length < 3) return { corners: kept, closed: false, ribs: [] };
    kept.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const far = farthest(kept);
    const [a, b] = far;
    const reach = distance(a, b);
    const off = (p) => Math.abs((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / reach;
    if (kept.every((p) => off(p) <= 1e-6 * reach)) {
        const along = (p) => (p[0] - a[0]) * (b[0] - a[0]) + (p[1] - a[1]) * (b[1] - a[1]);
        return { corners: kept.sort((p, q) => along(p) - along(q)), closed: false, ribs: [] };
    }
    const half = (order) => {
        const chain = [];
        for (const p of order) {
            while (chain.length > 1 && cross(chain[chain.length - 2], chain[chain.length - 1], p) <= 0) chain.pop();
            chain.push(p);
        }
        return chain.slice(0, -1);
    };
    const corners = [...half(kept), ...half([...kept].reverse())];
    const ribs = kept
        .filter((p) => !corners.includes(p))
        .map((p) => [corners.reduce((best, c) => (distance(c, p) < distance(best, p) ? c : best)), p]);
    return { corners, closed: true, ribs };
}

// Return the pixels, y down, of points of a strip: each a part of the length of its base, plus a length of the mechanism, plus
// details of a size along and across.
export function symbol({ at, along: [x, y], length }, points, scale, size, flips = [1, 1]) {
    return points.map(([part, own, detail, across]) => {
        const ahead = Math.min(Math.max(part * length + own * scale, 0), length) + size * detail * flips[0];
        const side = size * across * flips[1];
        return [at[0] + ahead * x + side * y, at[1] + ahead * y - side * x];
    });
}

// Return whether a plate is so narrow that bars of a width along its edges meet.
export function isSlim(points, width) {
    const sides = points.map((p, k) => [p, points[(k + 1) % points.length]]);
    const area = 0.5 * Math.abs(sides.reduce((sum, [p, q]) => sum + p[0] * q[1] - q[0] * p[1], 0));
    return area < width * Math.max(...sides.map((side) => distance(...side)));
}

function cross(o, a, b) {
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

function farthest(points) {
    let best = [points[0], points[1]];
    for (const a of points) for (const b of points) if (distance(a, b) > distance(...best)) best = [a, b];
    return best;
}

// Return the solution x of least size of A x = b, damped; A: rows of numbers.
export function leastSquares(rows, b, damping) {
    const m = rows.length;
    const g = rows.map((r, i) => rows.map((s, j) => r.reduce((sum, v, k) => sum + v * s[k], 0) + (i === j ? damping : 0)));
    const y = [...b];
    for (let i = 0; i < m; i++) {
        if (Math.abs(g[i][i]) < 1e-300) return null;
        for (let j = i + 1; j < m; j++) {
            const part = g[j][i] / g[i][i];
            for (let k = i; k < m; k++) g[j][k] -= part * g[i][k];
            y[j] -= part * y[i];
        }
    }
    for (let i = m - 1; i >= 0; i--) {
        for (let j = i + 1; j < m; j++) y[i] -= g[i][j] * y[j];
        y[i] /= g[i][i];
    }
    return rows[0].map((_, k) => rows.reduce((sum, row, i) => sum + row[k] * y[i], 0));
}
