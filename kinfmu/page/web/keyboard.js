// The keys of the page.

import { $ } from "./elements.js";

export function keyboard(page) {
    const isField = (target) => target.closest?.("input, select, textarea, dialog[open], [role=tab]") || target.tagName === "CANVAS" && target !== page.canvas;
    document.addEventListener("keydown", (event) => {
        const key = event.key.toLowerCase();
        if ((event.ctrlKey || event.metaKey) && (key === "z" || key === "y")) {
            event.preventDefault();
            page.undo(key === "y" || event.shiftKey);
            return;
        }
        if (isField(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
        const { linkage } = page;
        const k = page.driver;
        const step = linkage.data.drivers[k]?.kind === "angle" ? Math.PI / 180 : (linkage.ranges[k][1] - linkage.ranges[k][0]) / 200;
        const by = (way) => {
            page.motion.play(false);
            page.refresh(() => page.move(k, linkage.u[k] + way * step * (event.shiftKey ? 10 : 1))); // every press counts
            page.address.writeSoon();
        };
        const choose = (way) => {
            const { drivers } = linkage.data;
            page.driver = (page.driver + way + drivers.length) % drivers.length;
            if (drivers.length > 1) page.hint(`Arrow keys move ${drivers[page.driver].name}`);
        };
        const pan = (x, y) => {
            page.view.pan(x, y);
            page.refresh();
        };
        const { hand } = page;
        const far = event.shiftKey ? 10 : 1;
        const arrow = (x, y) => (hand.pin !== null ? hand.movePin(x * far, y * far) : x ? by(x) : choose(-y));
        const acts = {
            arrowleft: () => arrow(-1, 0), arrowright: () => arrow(1, 0), arrowup: () => arrow(0, 1), arrowdown: () => arrow(0, -1),
            p: () => hand.choosePin(event.shiftKey ? -1 : 1), escape: () => hand.leavePin(),
            home: () => (linkage.data.over ? page.pick("driver", linkage.data.over.from) : page.pick("time", linkage.data.run.from)), "+": () => page.zoom(1.2), "=": () => page.zoom(1.2), "-": () => page.zoom(1 / 1.2),
            f: () => page.fit(), e: () => page.toggleMode(), "?": () => $("keys").showModal(),
            w: () => pan(0, 40), s: () => pan(0, -40), a: () => pan(40, 0), d: () => pan(-40, 0),
        };
        if (event.target === page.canvas || event.target === document.body) acts[" "] = () => page.motion.play();
        const act = acts[key] && ((key.startsWith("arrow") || key === "home") && event.target !== page.canvas && event.target !== document.body ? null : acts[key]);
        if (!act) return;
        event.preventDefault();
        act();
    });
}
