// Pens: the same drawing on a canvas or as SVG text, and the colours of both themes. All places are in pixels, y down.

export const THEMES = {
    light: { paper: "#ffffff", ink: "#1c2430", quiet: "#5b6675", grid: "#e9edf2", accent: "#0b5cad", bad: "#b3261e", isDark: false },
    dark: { paper: "#12171d", ink: "#e8edf3", quiet: "#9aa7b6", grid: "#1f2730", accent: "#6cb6ff", bad: "#ff9b93", isDark: true },
};

const LEAST_CONTRAST = 4.5; // of text, as WCAG AA has it

function mix(colour, other, part) {
    return colour.map((value, k) => Math.round(value + part * (other[k] - value)));
}

export function css([r, g, b], alpha = 1) {
    return alpha < 1 ? `rgba(${r},${g},${b},${alpha})` : `rgb(${r},${g},${b})`;
}

// The table of strokes and the roles of their colours, as kinfmu/draw/scene/strokes.py has them.
export const LOOK = {};

// Return the colour of a stroke: of a role of the table, for a thing of a colour.
export function tint(role, colour, theme) {
    return css(mix(colour, ...LOOK.roles[role][theme.isDark ? 1 : 0]));
}

// Return the colour of a name: that of edges, with at least the contrast that readers need on paper.
export function inkOf(colour, theme) {
    const [paper] = LOOK.roles.paper[theme.isDark ? 1 : 0];
    const [towards, least] = LOOK.roles.edge[theme.isDark ? 1 : 0];
    for (let part = least; ; part += 0.05) {
        const mixed = mix(colour, towards, Math.min(part, 1));
        if (part >= 1 || contrast(mixed, paper) >= LEAST_CONTRAST) return css(mixed);
    }
}

// Return the contrast of two colours, as WCAG defines it.
function contrast(a, b) {
    const light = (colour) => {
        const [red, green, blue] = colour.map((value) => (value / 255 <= 0.04045 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4));
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue + 0.05;
    };
    const [x, y] = [light(a), light(b)];
    return Math.max(x, y) / Math.min(x, y);
}

export const GREY = [150, 150, 150];

export class CanvasPen {
    constructor(context) {
        this.context = context;
    }

    line(points, { width = 1, colour = null, fill = null, closed = false, dash = null, cap = "round", alpha = 1 } = {}) {
        const c = this.context;
        if (points.length < 2) return;
        c.globalAlpha = alpha;
        c.beginPath();
        c.moveTo(points[0][0], points[0][1]);
        for (let k = 1; k < points.length; k++) c.lineTo(points[k][0], points[k][1]);
        if (closed) c.closePath();
        this.#paint(width, colour, fill, dash, cap);
    }

    circle(x, y, radius, { width = 1, colour = null, fill = null, dash = null, alpha = 1 } = {}) {
        const c = this.context;
        c.globalAlpha = alpha;
        c.beginPath();
        c.arc(x, y, Math.max(radius, 0), 0, 2 * Math.PI);
        this.#paint(width, colour, fill, dash, "butt");
    }

    text(x, y, text, { colour, size = 12, align = "left", halo = null, italic = false, bold = false } = {}) {
        const c = this.context;
        c.globalAlpha = 1;
        const font = `${italic ? "italic " : ""}${bold ? "600 " : ""}${size}px ${FONT}`;
        if (font !== this.font) c.font = this.font = font; // reading a font takes the browser long
        c.textAlign = align;
        c.textBaseline = "middle";
        if (halo) {
            c.lineWidth = 3;
            c.lineJoin = "round";
            c.strokeStyle = halo;
            c.strokeText(text, x, y);
        }
        c.fillStyle = colour;
        c.fillText(text, x, y);
    }

    #paint(width, colour, fill, dash, cap) {
        const c = this.context;
        if (fill) {
            c.fillStyle = fill;
            c.fill();
        }
        if (colour) {
            c.lineWidth = width;
            c.lineCap = cap;
            c.lineJoin = "round";
            if (dash) c.setLineDash(dash);
            c.strokeStyle = colour;
            c.stroke();
            if (dash) c.setLineDash([]);
        }
        c.globalAlpha = 1;
    }
}

export class SvgPen {
    constructor(width, height, background) {
        this.head = `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}">`;
        this.parts = [`<rect width="${width}" height="${height}" fill="${background}"/>`];
    }

    line(points, { width = 1, colour = null, fill = null, closed = false, dash = null, cap = "round", alpha = 1 } = {}) {
        if (points.length < 2) return;
        const path = points.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("");
        this.parts.push(`<path d="${path}${closed ? "Z" : ""}"${this.#style(width, colour, fill, dash, cap, alpha)}/>`);
    }

    circle(x, y, radius, { width = 1, colour = null, fill = null, dash = null, alpha = 1 } = {}) {
        const place = `cx="${x.toFixed(2)}" cy="${y.toFixed(2)}" r="${Math.max(radius, 0).toFixed(2)}"`;
        this.parts.push(`<circle ${place}${this.#style(width, colour, fill, dash, "butt", alpha)}/>`);
    }

    text(x, y, text, { colour, size = 12, align = "left", halo = null, italic = false, bold = false } = {}) {
        const anchor = { left: "start", center: "middle", right: "end" }[align];
        const escaped = text.replace(/&/g, "&amp;").replace(/</g, "&lt;");
        const around = halo ? ` stroke="${halo}" stroke-width="3" paint-order="stroke" stroke-linejoin="round"` : "";
        const style = `${italic ? ' font-style="italic"' : ""}${bold ? ' font-weight="600"' : ""}`;
        this.parts.push(
            `<text x="${x.toFixed(2)}" y="${y.toFixed(2)}" dy="0.35em" fill="${colour}" font-size="${size}" ` +
                `text-anchor="${anchor}"${around}${style}>${escaped}</text>`,
        );
    }

    svg() {
        return `${this.head}<g font-family="sans-serif">${this.parts.join("\n")}</g></svg>\n`;
    }

    #style(width, colour, fill, dash, cap, alpha) {
        const stroke = colour
            ? ` stroke="${colour}" stroke-width="${width.toFixed(2)}" stroke-linecap="${cap}" stroke-linejoin="round"`
            : "";
        const dashes = dash ? ` stroke-dasharray="${dash.join(" ")}"` : "";
        return ` fill="${fill || "none"}"${stroke}${dashes}${alpha < 1 ? ` opacity="${alpha}"` : ""}`;
    }
}

// Return the width of a text [px] in the font of the drawing.
export function widthOf(text, size = 12) {
    if (!ruler) ruler = document.createElement("canvas").getContext("2d");
    const font = `${size}px ${FONT}`;
    if (ruler.font !== font) ruler.font = font;
    return ruler.measureText(text).width;
}

let ruler = null;

export const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';
