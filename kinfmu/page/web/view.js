// The view: which part of the plane is on the canvas, y up.

export const BUTTONS = 40; // [px] of the height, above the drawing

export class View {
    constructor() {
        Object.assign(this, { width: 1, height: 1, scale: 1, x: 0, y: 0, isFitted: true });
    }

    pixel([x, y]) {
        return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale];
    }

    plane([px, py]) {
        return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
    }

    fit([x0, y0, x1, y1]) {
        const [across, upright] = [this.width, this.height].map((size) => Math.min(64, 0.12 * size));
        const [w, h] = [Math.max(x1 - x0, 1e-12), Math.max(y1 - y0, 1e-12)];
        const [aw, ah] = [Math.max(this.width - 2 * across, 20), Math.max(this.height - 2 * upright - BUTTONS, 20)];
        this.scale = Math.min(aw / w, ah / h);
        [this.x, this.y] = [(x0 + x1) / 2, (y0 + y1 + BUTTONS / this.scale) / 2];
        this.isFitted = true;
    }

    zoom(factor, at = [this.width / 2, this.height / 2]) {
        const before = this.plane(at);
        this.scale *= factor;
        const after = this.plane(at);
        this.x += before[0] - after[0];
        this.y += before[1] - after[1];
        this.isFitted = false;
    }

    pan(dx, dy) {
        this.x -= dx / this.scale;
        this.y += dy / this.scale;
        this.isFitted = false;
    }
}
