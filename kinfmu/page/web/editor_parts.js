// The parts that the editor adds to the page: tools, buttons, badge, banner, panel, keys.

import { $, element } from "./elements.js";
import { TOOLS } from "./editor_tools.js";

const ICONS = {
    move: '<path d="M5 3l10 7-5 1-2 5z"/>',
    link: '<circle cx="4.5" cy="15.5" r="2.3"/><circle cx="15.5" cy="4.5" r="2.3"/><path d="M6.2 13.8 13.8 6.2"/>',
    pin: '<path d="M2.5 16 8 11.5M17.5 16 12 11.5"/><circle cx="10" cy="9.5" r="2.8"/>',
    ground: '<path d="M10 3.5 5 12h10zM2.5 12h15M5 16l2-4M9.5 16l2-4M14 16l2-4"/>',
    motor: '<path d="M4.2 12.5a6.3 6.3 0 1 1 4 3.6M2.5 9.5l1.6 3.2L7.2 11"/><circle class="full" cx="10" cy="10" r="1.5"/>',
    slider: '<rect x="5.5" y="5" width="9" height="6.5" rx="1"/><path d="M2 14h16M4 17l2-3M9 17l2-3M14 17l2-3"/>',
    slot: '<rect x="2" y="6.5" width="16" height="7" rx="3.5"/><circle cx="7.5" cy="10" r="1.8"/>',
    cylinder: '<path d="M2.5 6.5H12v7H2.5zM12 10h6"/>',
    gear: '<circle cx="7" cy="11" r="4.6" stroke-dasharray="2.2 1.2"/><circle cx="14.8" cy="7" r="3.2" stroke-dasharray="2 1"/>',
    cam: '<path d="M8.5 4.5c5.5 0 9 3 9 6s-3.5 5.5-9 5.5a5.7 5.7 0 0 1 0-11.5z"/><circle class="full" cx="8" cy="10.3" r="1.3"/>',
    spring: '<path d="M1.5 10h3L6 5.5l3 9 3-9 3 9 1-4.5h2.5"/>',
    force: '<path d="M3.5 16.5 16 4M9.5 4H16v6.5"/>',
    interest: '<circle class="full" cx="10" cy="10" r="2.4"/><path d="M10 2v4M10 14v4M2 10h4M14 10h4"/>',
    delete: '<path d="M5 5l10 10M15 5 5 15"/>',
};
const PEN = '<svg viewBox="0 0 20 20"><path d="M3 17l1-4L14 3l3 3L7 16zM12 5l3 3"/></svg>';
const KEYS = [
    ["A letter, or <kbd>Tab</kbd> to a button", `chooses a tool: ${TOOLS.map(({ key, label }) => `<kbd>${key.toUpperCase()}</kbd> ${label.toLowerCase()}`).join(", ")}`],
    ["Arrow keys, <kbd>Enter</kbd>", "move a cursor on the grid, with <kbd>Shift</kbd> ten times as far; click there"],
    ["Digits", "type a length, a length &lt; angle in degrees, or x, y; <kbd>Enter</kbd> accepts it"],
    ["<kbd>Alt</kbd>, <kbd>Shift</kbd> with a click", "nothing snaps; links snap to steps of 15\u00b0"],
    ["<kbd>Esc</kbd>", "leaves a link half-way, then the tool"],
    ["<kbd>Space</kbd>, <kbd>V</kbd>", "play the mechanism; draw again"],
    ["<kbd>Del</kbd>, <kbd>Ctrl</kbd>+<kbd>S</kbd>", "delete what is selected; save"],
    ["<kbd>Ctrl</kbd>+<kbd>Z</kbd>, <kbd>Ctrl</kbd>+<kbd>Y</kbd>", "undo, redo"],
    ["<kbd>+</kbd> <kbd>-</kbd>, <kbd>Home</kbd>", "zoom, as the wheel or two fingers; fit to view"],
    ["Middle button, or two fingers", "move the view"],
];
const OF_PAGE = ["<kbd>V</kbd>", "draws: changes the mechanism itself"];

// Add the parts; what they do is the editor's.
export function buildEditor(editor) {
    const { page } = editor;
    document.head.append(element("style", { textContent: EDITOR_STYLE }));
    const header = document.querySelector("header");
    const tools = element("nav", { id: "draw-tools", "aria-label": "Drawing tools", hidden: true });
    for (const { id, key, label, hints } of TOOLS) {
        const button = element("button", { title: `${hints[0]} (${key.toUpperCase()})`, "aria-pressed": "false" });
        button.dataset.tool = id;
        button.innerHTML = `<svg viewBox="0 0 20 20">${ICONS[id]}</svg><span>${label}</span>`;
        button.addEventListener("click", () => {
            editor.choose(id);
            page.canvas.focus({ preventScroll: true });
        });
        tools.append(button);
    }
    header.after(tools);
    const save = element("button", { id: "save", title: "Write the file (Ctrl+S)", textContent: "Save", hidden: true });
    save.addEventListener("click", () => editor.save());
    $("reset").before(save);
    const button = element("button", { id: "draw", title: "Draw: change the mechanism itself", "aria-pressed": "false" });
    button.innerHTML = `${PEN}<span>Draw</span>`;
    button.addEventListener("click", () => (editor.machine && editor.isPlayable ? editor.leave() : editor.choose(editor.sketch && !editor.sketch.data.points.length ? "link" : "move")));
    $("edit").before(button, element("span", { id: "badge", role: "status", hidden: true }));
    $("stage").append(element("div", { id: "draw-banner", role: "alert", hidden: true }));
    $("stage").after(element("div", { id: "draw-bar", hidden: true }));
    const panel = element("div", { id: "draw-panel", hidden: true });
    document.querySelector("aside").append(panel);
    Object.assign($("keys-title"), { tabIndex: -1, autofocus: true }); // the dialog begins at its top
    for (const [head, text] of [OF_PAGE, ...KEYS]) {
        const row = element("tr", { className: head === OF_PAGE[0] ? "" : "of-drawing" });
        row.innerHTML = `<td>${head}</td><td>${text}</td>`;
        document.querySelector("#keys table").append(row);
    }
    for (const kind of ["click", "input"]) $("transport").addEventListener(kind, () => editor.leave(), true);
}
