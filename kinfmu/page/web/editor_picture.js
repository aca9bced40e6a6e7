// A picture behind the drawing, to draw a mechanism from a photograph; it stays in this page.

import { distance } from "./geometry.js";

// Tools of the picture, with what they wait for.
export const OF_PICTURE = { scale: ["Click one end of a known length in the picture.", "Click its other end.", "Type this length."], shift: ["Click a place of the picture.", "Click where it belongs."] };

export class Picture {
    constructor() {
        Object.assign(this, { image: null, at: [0, 0], size: 1, alpha: 0.5 }); // at: its upper left corner; size: of a pixel, in the unit
    }

    // Take a file as the picture, over most of a view.
    async load(file, view) {
        this.image = await createImageBitmap(file);
        const { width, height } = this.image;
        this.size = 0.8 * Math.min(view.width / width, view.height / height) / view.scale;
        this.at = [view.x - 0.5 * width * this.size, view.y + 0.5 * height * this.size];
    }

    paint(context, view) {
        if (!this.image) return;
        const [x, y] = view.pixel(this.at);
        const scale = this.size * view.scale;
        context.globalAlpha = this.alpha;
        context.drawImage(this.image, x, y, this.image.width * scale, this.image.height * scale);
        context.globalAlpha = 1;
    }

    // Make two places of the picture so far apart; the first one stays.
    scale(a, b, length) {
        const factor = length / distance(a, b);
        this.size *= factor;
        this.at = [0, 1].map((k) => a[k] + factor * (this.at[k] - a[k]));
    }

    move(from, to) {
        this.at = [0, 1].map((k) => this.at[k] + to[k] - from[k]);
    }
}
