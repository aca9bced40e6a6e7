// The page: one mechanism, its drawing, the hand on the drawing, motion over time, panels.

import { Address, Design } from "./design.js";
import { arrows } from "./marks.js";
import { CanvasPen, LOOK, THEMES } from "./pen.js";
import { draw, fineness, foresee } from "./drawing.js";
import { $, breakable, describe, element, shownUnit } from "./elements.js";
import { unpacked } from "./engine.js";
import { Frames, Motion } from "./motion.js";
import { Hand, keyboard } from "./hand.js";
import { linkageOf } from "./linkage.js";
import { number, ofJoints, withStop } from "./numbers.js";
import { PATIENCE, Spots } from "./names.js";
import { filesPanel, Plots, showPanel } from "./panels.js";
import { Transport } from "./transport.js";
import { Values } from "./values.js";
import { View } from "./view.js";

const TRACE = 600; // points of a trace
const RESTS = 150; // [ms] after the last change of a value

class Page {
    // linkage: null without a mechanism that moves; solver: unpacked, for the mechanisms that `take` is given
    constructor(linkage, solver) {
        this.solver = solver;
        this.view = new View();
        this.show = { names: true, curves: true, traces: false, velocity: false, acceleration: false, centres: false, limits: true, loads: true, forces: false, shaking: false, grid: true };
        this.handles = []; // of drivers, as drawn
        this.open = null; // what is known of values that do not close, as Linkage.closing returns it
        this.hasHidden = false; // names without a place
        this.now = performance.now(); // [ms] of the frame
        this.mode = "move";
        this.editor = null; // in which the mechanism is drawn by hand, if the page is served for that
        this.whenTaken = () => {}; // what else is made anew for another mechanism
        this.whenEnded = () => {}; // states that the server of the page does not answer
        this.canvas = $("drawing");
        this.context = this.canvas.getContext("2d");
        this.frames = new Frames((now, work) => this.frame(now, work));
        this.address = new Address(this);
        this.#theme(storedTheme());
        this.#header();
        this.#tabs();
        this.#folds();
        this.hand = new Hand(this);
        keyboard(this);
        if (linkage) this.take(linkage);
        new ResizeObserver(() => this.#resize()).observe($("stage"));
        this.#resize();
    }

    // Show a mechanism, in place of the one before.
    take(linkage) {
        const { data } = linkage;
        const isFirst = !this.linkage;
        if (this.isPlaying) this.motion.play(false);
        this.linkage = linkage;
        const locked = this.design?.locked || [];
        this.design = new Design(linkage);
        this.design.lock(locked);
        this.show.transmission ??= data.loops.length > 0 && data.loops.length < 4;
        this.drawn = data.interest.map(({ point, colour }) => ({ point, colour })); // points with curves
        this.curves = [];
        this.traces = new Map();
        this.spots = new Spots(); // of names
        this.isToForesee = true; // before the next frame: it takes as long as some frames
        this.driver = 0;
        this.hand.pin = null;
        $("name").textContent = breakable(data.name);
        $("title").textContent = data.title;
        if (!linkage.parameters.some((one) => one.points.length)) $("edit").hidden = true;
        for (const id of ["values", "plots", "show", "files", "drivers", "speed"]) $(id).replaceChildren();
        this.motion = new Motion(this);
        this.transport = new Transport(this);
        this.values = new Values(this, $("values"));
        this.plots = new Plots(this, $("plots"));
        showPanel(this, $("show"));
        filesPanel(this, $("files"));
        if (isFirst) this.address.read();
        linkage.fineness = fineness(linkage);
        if (isFirst) this.fit();
        this.reshape();
        this.whenTaken();
    }

    // ---- frames

    get isAsked() {
        return this.frames.isAsked;
    }

    // Ask for a new drawing in the next frame; work: what is done first, instead of work that waits under the same key.
    refresh(work = null, key = undefined) {
        this.frames.ask(work, key);
    }

    frame(now, waiting) {
        this.now = now;
        if (this.isPlaying) this.motion.advance(now);
        for (const work of waiting) work();
        this.#trace();
        this.paint();
        return this.isPlaying;
    }

    // The lengths are others: curves, ranges and plots follow, and the drawing in the next frame.
    reshape() {
        if (this.design.isOk) {
            this.linkage.findRanges();
            this.curves = this.linkage.curves(this.drawn.map((one) => one.point));
            this.traces.clear();
            this.plots.refresh();
        }
        this.#findOpen();
        this.values.update();
        this.transport.setRanges();
        this.refresh();
    }

    paint() {
        const { context: c, view, linkage } = this;
        const ratio = window.devicePixelRatio || 1;
        c.setTransform(ratio, 0, 0, ratio, 0, 0);
        c.clearRect(0, 0, view.width, view.height);
        if (this.editor?.paint(c) || !linkage) return;
        this.spots.begin(this.now, linkage.pose, view);
        const state = `${this.spots.state} ${linkage.changed}`;
        if (this.isToForesee && this.show.names && state !== this.foreseen) {
            this.foreseen = state;
            foresee(linkage, view, this.theme, this.show, this.spots);
        }
        this.isToForesee = false;
        const drawn = draw(new CanvasPen(c), linkage, view, this.theme, this.show, this.extra(), this.spots);
        [this.handles, this.hasHidden] = [drawn.handles, drawn.hasHidden];
        clearTimeout(this.settling);
        if (this.spots.isWaiting && !this.isPlaying) this.settling = setTimeout(() => this.refresh(), PATIENCE);
        this.#readouts();
        this.plots.draw();
    }

    // Return what is drawn besides the linkage: curves and traces, arrows, the place that is held, the pointer.
    extra() {
        const curves = this.drawn.map(({ colour }, k) => ({ line: this.curves[k] || [], colour }));
        if (this.show.traces) for (const [point, line] of this.traces) curves.push({ line, colour: this.drawn.find((one) => one.point === point)?.colour || [90, 90, 90], isTrace: true });
        const { found, legend } = arrows(this);
        return { curves, arrows: found, legend, held: this.hand.place, pointer: this.hand.pointer, isOnPins: this.mode === "move", gaps: this.open?.gaps || [], pose: this.open?.pose, isGhost: !this.design.isOk };
    }

    #trace() {
        if (!this.show.traces) return;
        for (const { point } of this.drawn) {
            const line = this.traces.get(point) || [];
            line.push(this.linkage.point(point));
            if (line.length > TRACE) line.shift();
            this.traces.set(point, line);
        }
    }

    #readouts() {
        this.transport.update();
        const { design, linkage, motion } = this;
        if (!this.isPlaying) describe(this.canvas, `Drawing of the mechanism at ${this.transport.pose()}. Arrow keys move the driver, space plays, question mark lists all keys.`);
        const note = linkage.leftOut.length ? `Not drawn with these values: ${linkage.leftOut.join("; ")}. The lines of kinfmu check hold for the saved file.` : "";
        if ($("note").textContent !== note) [$("note").textContent, $("note").hidden] = [note, !note]; // screen readers speak it
        $("undo").disabled = !design.past.length && !this.editor?.canUndo(false);
        $("redo").disabled = !design.future.length && !this.editor?.canUndo(true);
        $("reset").disabled = !design.changes().length;
        const head = design.isInvalid ? "Not valid: " : design.isOtherBranch ? "Another branch: " : "Does not close: ";
        const shown = this.open ? "In grey with these values, as far as it closes; the gap is red." : "The last good pose is shown in grey.";
        if (!design.isOk) this.#banner(head, `${withStop(this.inWords(design.failure))} ${shown}`, this.#wayBack());
        else this.#banner("Stops here: ", motion.blocked && withStop(this.inWords(motion.blocked)));
    }

    // Return why something does not close, with joints and drivers in place of rows.
    inWords(failure) {
        return ofJoints(failure, this.linkage.data.drivers.map((driver) => driver.name));
    }

    // back: { label, changes } of a button that sets values
    #banner(head, text, back = null) {
        const banner = $("banner");
        const shown = text ? head + text + (back?.label || "") : "";
        if (banner.dataset.text === shown) return;
        banner.dataset.text = shown;
        banner.hidden = !shown;
        banner.replaceChildren(element("b", { textContent: head }), document.createTextNode(text));
        if (!back) return;
        const button = element("button", { textContent: back.label });
        button.addEventListener("click", () => {
            this.setValues(back.changes);
            this.commit();
        });
        banner.append(button);
    }

    // Return the value of the panel that closes, next to one that does not: { label, changes }; null if that is unknown.
    #wayBack() {
        const { design, linkage, open } = this;
        if (!open) return null;
        const names = [...design.values.keys()].filter((name) => design.values.get(name) !== linkage.bound.get(name));
        const [row] = this.values.rows.filter(({ one }) => names.every((name) => one.names.includes(name))).sort((a, b) => a.one.names.length - b.one.names.length);
        if (!row) return null;
        const [before, closing, tried] = [linkage.bound, open.values, design.values].map((values) => row.one.read(values) * row.factor);
        const step = 10 ** Math.floor(Math.log10(Math.abs(tried - before)) - 1);
        const towards = tried > before ? Math.floor : Math.ceil;
        const rounded = Number((towards(closing / step) * step).toPrecision(9));
        const value = (rounded - before) * (tried - before) > 0 ? rounded : closing;
        return { label: `closes ${tried > before ? "up to" : "from"} ${number(value, 9)} ${shownUnit(row.one.unit).unit}`.trim(), changes: row.one.changes(value / row.factor, design.values) };
    }

    // Find how far values that do not close are from closing, when they rest.
    #findOpen() {
        this.open = null;
        clearTimeout(this.opening);
        if (this.design.isOk || this.design.isOtherBranch || this.design.isInvalid) return;
        this.opening = setTimeout(() => {
            if (!this.design.isOk) this.refresh(() => (this.open = this.linkage.closing(this.design.values)));
        }, RESTS);
    }

    // ---- motion

    get isPlaying() {
        return Boolean(this.motion?.isPlaying);
    }

    get blocked() {
        return this.motion.blocked;
    }

    move(k, value) {
        return this.motion.move(k, value);
    }

    pick(over, x) {
        this.motion.pick(over, x);
    }

    // ---- design

    setValues(changes) {
        this.refresh(() => {
            this.design.set(changes);
            this.#taken();
        }, `value ${Object.keys(changes)}`);
    }

    // Make the values since the last commit one step to undo, after the work that waits.
    commit() {
        this.refresh(() => {
            this.design.commit();
            this.address.write();
        });
    }

    undo(isRedo = false) {
        if (this.editor?.canUndo(isRedo)) {
            this.editor.undo(isRedo);
            return;
        }
        if (this.editor?.isShown) return;
        this.refresh(() => {
            if (!(isRedo ? this.design.redo() : this.design.undo())) return;
            this.#taken();
            this.address.write();
        });
    }

    // The design has other values, and a move before that stopped is no more what is shown.
    #taken() {
        this.motion.blocked = "";
        this.reshape();
    }

    // Take over values that did not close before, at a pose where they may.
    recover() {
        if (this.design.isOk) return;
        if (this.design.set({})) this.reshape();
        else this.#findOpen();
    }

    // ---- parts of the page

    #theme(name) {
        document.documentElement.dataset.theme = name;
        this.theme = THEMES[name];
    }

    #header() {
        $("undo").addEventListener("click", () => this.undo());
        $("redo").addEventListener("click", () => this.undo(true));
        $("reset").addEventListener("click", () => {
            this.refresh(() => {
                this.design.reset();
                this.#taken();
                this.address.write();
            });
        });
        $("theme").addEventListener("click", () => {
            const name = this.theme.isDark ? "light" : "dark";
            this.#theme(name);
            try {
                localStorage.setItem("kinfmu-theme", name);
            } catch {
                // A page from a file may have no storage: the choice lasts until it is closed.
            }
            this.refresh();
        });
        $("help").addEventListener("click", () => $("keys").showModal());
        $("fit").addEventListener("click", () => this.fit());
        $("in").addEventListener("click", () => this.zoom(1.3));
        $("out").addEventListener("click", () => this.zoom(1 / 1.3));
        $("edit").addEventListener("click", () => this.toggleMode());
    }

    // Add a way to the gallery, where the page is served.
    linkGallery(href) {
        const link = element("a", { href, className: "button", title: "Mechanisms of the gallery", "aria-label": "Gallery" });
        link.innerHTML = '<svg viewBox="0 0 20 20"><path d="M3.5 3.5h5v5h-5zM11.5 3.5h5v5h-5zM3.5 11.5h5v5h-5zM11.5 11.5h5v5h-5z"/></svg>';
        $("theme").before(link);
    }

    fit() {
        this.view.fit(this.editor?.box ?? this.linkage.box());
        this.isToForesee = true;
        this.refresh();
    }

    zoom(factor, at) {
        this.view.zoom(factor, at);
        this.refresh();
    }

    toggleMode() {
        this.mode = this.mode === "move" ? "lengths" : "move";
        $("edit").setAttribute("aria-pressed", String(this.mode === "lengths"));
        document.body.classList.toggle("lengths", this.mode === "lengths"); // shows the locks
        this.refresh();
        if (this.mode === "lengths") this.hint("Drag a pin. Lock values in the panel to keep them.");
        else this.hand.leavePin();
    }

    hint(text) {
        $("hint").textContent = text;
        $("hint").hidden = !text;
        clearTimeout(this.hiding);
        if (text) this.hiding = setTimeout(() => ($("hint").hidden = true), 4000);
    }

    #tabs() {
        const tabs = [...$("tabs").children];
        const choose = (tab) => {
            for (const one of tabs) {
                const isChosen = one === tab;
                one.setAttribute("aria-selected", String(isChosen));
                one.tabIndex = isChosen ? 0 : -1;
                $(one.getAttribute("aria-controls")).hidden = !isChosen;
            }
        };
        tabs.forEach((tab, k) => {
            tab.addEventListener("click", () => choose(tab));
            tab.addEventListener("keydown", (event) => {
                const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
                if (!way) return;
                const next = tabs[(k + way + tabs.length) % tabs.length];
                choose(next);
                next.focus();
            });
        });
    }

    // Open or close the plots, or on a small page the panels, by their buttons.
    #folds() {
        const fold = (id, open) => $(id).addEventListener("click", () => {
            const isOpen = $(id).getAttribute("aria-expanded") !== "true";
            $(id).setAttribute("aria-expanded", String(isOpen));
            open(isOpen);
            this.refresh();
        });
        fold("tab-plots", (isOpen) => ($("plots").hidden = !isOpen));
        fold("sheet", (isOpen) => document.body.classList.toggle("sheet", isOpen));
    }

    #resize() {
        const { canvas, view } = this;
        const box = $("stage").getBoundingClientRect();
        const ratio = window.devicePixelRatio || 1;
        [view.width, view.height] = [box.width, box.height];
        [canvas.width, canvas.height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
        if (view.isFitted && this.linkage) this.fit();
        this.isToForesee = true;
        this.refresh();
    }
}

function storedTheme() {
    try {
        const stored = localStorage.getItem("kinfmu-theme");
        if (stored in THEMES) return stored;
    } catch {
        // Without storage the system decides.
    }
    return window.matchMedia?.("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

async function start() {
    try {
        const data = JSON.parse(new TextDecoder().decode(await unpacked($("data").textContent)));
        const solver = await unpacked(data.solver);
        Object.assign(LOOK, data.look);
        window.kinfmu = new Page(data.modules && (await linkageOf(data, solver)), solver);
        window.kinfmu.isEditable = data.isEditable;
        if (data.modules && !location.hash && window.matchMedia("(prefers-reduced-motion: no-preference)").matches) window.kinfmu.motion.showOnce();
        return window.kinfmu;
    } catch (error) {
        $("banner").hidden = false;
        $("banner").textContent = `The mechanism cannot be shown: ${error.message}`;
        throw error;
    }
}

const started = start(); // scripts that are added to the page wait for it
