// Colours: of the light and the dark theme, and of shapes in each.

export const THEMES = {
    light: { paper: "#ffffff", ink: "#1c2430", quiet: "#5b6675", grid: "#e9edf2", accent: "#0b5cad", bad: "#b3261e", pin: "#ffffff", isDark: false },
    dark: { paper: "#12171d", ink: "#e8edf3", quiet: "#9aa7b6", grid: "#1f2730", accent: "#6cb6ff", bad: "#ff9b93", pin: "#12171d", isDark: true },
};

const LEAST_CONTRAST = 4.5; // of text, as WCAG AA has it

function mix(colour, other, part) {
    return colour.map((value, k) => Math.round(value + part * (other[k] - value)));
}

export function css([r, g, b], alpha = 1) {
    return alpha < 1 ? `rgba(${r},${g},${b},${alpha})` : `rgb(${r},${g},${b})`;
}

export function edgeOf(colour, theme) {
    return css(theme.isDark ? mix(colour, [255, 255, 255], 0.25) : mix(colour, [0, 0, 0], 0.45));
}

// Return the colour of a name: that of edges, with at least the contrast that readers need on paper.
export function inkOf(colour, theme) {
    const [towards, paper] = theme.isDark ? [255, [18, 23, 29]] : [0, [255, 255, 255]];
    for (let part = theme.isDark ? 0.25 : 0.45; ; part += 0.05) {
        const mixed = mix(colour, [towards, towards, towards], Math.min(part, 1));
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

export function fillOf(colour, theme) {
    return css(theme.isDark ? mix(colour, [18, 23, 29], 0.55) : mix(colour, [255, 255, 255], 0.5));
}

export function paleOf(colour, theme) {
    return css(theme.isDark ? mix(colour, [18, 23, 29], 0.78) : mix(colour, [255, 255, 255], 0.82));
}

export const GREY = [150, 150, 150];
