// Colours: of the light and the dark theme, and of shapes in each.

export const THEMES = {
    light: { paper: "#ffffff", ink: "#1c2430", quiet: "#5b6675", grid: "#e9edf2", accent: "#0b5cad", bad: "#b3261e", pin: "#ffffff", isDark: false },
    dark: { paper: "#12171d", ink: "#e8edf3", quiet: "#9aa7b6", grid: "#1f2730", accent: "#6cb6ff", bad: "#ff9b93", pin: "#12171d", isDark: true },
};

function mix(colour, other, part) {
    return colour.map((value, k) => Math.round(value + part * (other[k] - value)));
}

export function css([r, g, b], alpha = 1) {
    return alpha < 1 ? `rgba(${r},${g},${b},${alpha})` : `rgb(${r},${g},${b})`;
}

export function edgeOf(colour, theme) {
    return css(theme.isDark ? mix(colour, [255, 255, 255], 0.25) : mix(colour, [0, 0, 0], 0.45));
}

export function fillOf(colour, theme) {
    return css(theme.isDark ? mix(colour, [18, 23, 29], 0.55) : mix(colour, [255, 255, 255], 0.5));
}

export function paleOf(colour, theme) {
    return css(theme.isDark ? mix(colour, [18, 23, 29], 0.78) : mix(colour, [255, 255, 255], 0.82));
}

export const GREY = [150, 150, 150];
