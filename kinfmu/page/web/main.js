// The page: one mechanism, its drawing, the hand on it, motion over time, panels.

import { draw, degrees, number, THEMES } from "./drawing.js";
import { Design } from "./design.js";
import { Engine } from "./engine.js";
import { TURN } from "./geometry.js";
import { gripAt, parametersOf, pinAt, place, pull, stretch } from "./grips.js";
import { Linkage } from "./linkage.js";
import { breakable, element, filesPanel, Plots, showPanel, shownUnit, Values } from "./panels.js";
import { CanvasPen } from "./pen.js";
import { View } from "./view.js";

const SPEEDS = [0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 4];
const LONGEST_PLAY = 8; // [s] of a run at the first speed; longer or shorter runs start at another one
const TRACE = 600; // points of a trace
const ARROW = 0.22; // of the smaller side of the view, longest arrow

const $ = (id) => document.getElementById(id);

class Page {
    constructor(linkage) {
        this.linkage = linkage;
        this.design = new Design(linkage);
        this.view = new View();
        this.show = { names: true, curves: true, traces: false, velocity: false, acceleration: false, transmission: linkage.data.loops.length > 0 && linkage.data.loops.length < 3, centres: false, limits: true, forces: false, grid: true };
        this.drawn = linkage.data.interest.map(({ point, colour }) => ({ point, colour }));
        this.curves = [];
        this.traces = new Map();
        this.mode = "move";
        this.driver = 0;
        this.isPlaying = false;
        this.frames = []; // [ms] of scripting, of the last frames
        this.canvas = $("drawing");
        this.context = this.canvas.getContext("2d");
        this.#theme(storedTheme());
        this.#header();
        this.#transport();
        this.#tabs();
        this.values = new Values(this, $("values"));
        this.plots = new Plots(this, $("plots"));
        showPanel(this, $("show"));
        filesPanel(this, $("files"));
        this.#pointer();
        this.#keyboard();
        this.ignored = this.design.read(location.hash);
        window.addEventListener("hashchange", () => {
            if (location.hash === this.written) return;
            this.ignored = this.design.read(location.hash);
            this.reshape();
        });
        linkage.fineness = fineness(linkage);
        new ResizeObserver(() => this.#resize()).observe($("stage"));
        this.#resize();
        this.view.fit(linkage.box());
        this.reshape();
        if (this.ignored.length) this.hint(`The address names what this mechanism does not have: ${this.ignored.join(", ")}`);
    }

    // ---- frames

    // Ask for a new drawing in the next frame; work: what is done first.
    refresh(work = null) {
        if (work) this.work = work;
        if (this.isAsked) return;
        this.isAsked = true;
        requestAnimationFrame((now) => {
            this.isAsked = false;
            const start = performance.now();
            this.frame(now);
            this.frames.push(performance.now() - start);
            if (this.frames.length > 600) this.frames.shift();
        });
    }

    frame(now) {
        if (this.isPlaying) this.#advance(now);
        const { work } = this;
        this.work = null;
        if (work) work();
        this.#trace();
        this.paint();
        if (this.isPlaying) this.refresh();
    }

    // The lengths are others: curves, ranges and plots follow, and the drawing in the next frame.
    reshape() {
        if (this.design.isOk) {
            this.linkage.findRanges();
            this.curves = this.linkage.curves(this.drawn.map((one) => one.point));
            this.traces.clear();
            this.plots.refresh();
        }
        this.values.update();
        this.#ranges();
        this.refresh();
    }

    paint() {
        const { context: c, view, linkage } = this;
        const ratio = window.devicePixelRatio || 1;
        c.setTransform(ratio, 0, 0, ratio, 0, 0);
        c.clearRect(0, 0, view.width, view.height);
        draw(new CanvasPen(c), linkage, view, this.theme, this.show, this.extra());
        this.#readouts();
        this.plots.draw();
    }

    extra() {
        const curves = this.drawn.map(({ colour }, k) => ({ line: this.curves[k] || [], colour }));
        if (this.show.traces) for (const [point, line] of this.traces) curves.push({ line, colour: this.drawn.find((one) => one.point === point)?.colour || [90, 90, 90], isTrace: true });
        return { curves, arrows: this.#arrows(), held: this.held, isGhost: !this.design.isOk };
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

    // Return arrows in pixels: velocities, accelerations and forces, each kind to its own scale.
    #arrows() {
        const { linkage, show, view } = this;
        const longest = ARROW * Math.min(view.width, view.height);
        const places = [...new Set([...this.drawn.map((one) => one.point), ...linkage.data.joints.flatMap((joint) => (joint.points || []).slice(-1))])];
        const moving = places.filter((point) => linkage.triples[linkage.bodyOf[point]][0] >= 0);
        const found = [];
        const add = (vectors, colour, unit) => {
            const most = Math.max(...vectors.map(({ v }) => Math.hypot(...v)), 0);
            if (!(most > 0) || !Number.isFinite(most)) return;
            const largest = vectors.find(({ v }) => Math.hypot(...v) === most);
            for (const one of vectors) found.push({ from: one.at, along: one.v.map((x) => (x * longest) / most), colour, text: one === largest ? `${number(most, 3)} ${unit}` : "" });
        };
        const unit = linkage.data.unit;
        if (show.velocity) add(moving.map((k) => ({ at: linkage.point(k), v: linkage.motionOf(linkage.bodyOf[k], linkage.point(k)).v })), (theme) => (theme.isDark ? [90, 200, 150] : [0, 120, 85]), `${unit}/s`);
        if (show.acceleration) add(moving.map((k) => ({ at: linkage.point(k), v: linkage.motionOf(linkage.bodyOf[k], linkage.point(k)).a })), (theme) => (theme.isDark ? [235, 150, 200] : [160, 50, 115]), `${unit}/s2`);
        if (show.forces && linkage.pose.forces) add(this.#forces(), (theme) => (theme.isDark ? [255, 160, 90] : [180, 70, 0]), "N");
        return found;
    }

    #forces() {
        const { linkage } = this;
        const at = new Map(linkage.part.forces.map(({ name }, k) => [name, linkage.pose.forces[k]]));
        const found = [];
        for (const joint of linkage.data.joints) {
            if (!joint.points) continue;
            const p = linkage.point(joint.points[joint.points.length - 1]);
            if (at.has(`${joint.name}.force_x`)) found.push({ at: p, v: [at.get(`${joint.name}.force_x`), at.get(`${joint.name}.force_y`)] });
            else if (at.has(`${joint.name}.force`)) {
                const force = at.get(`${joint.name}.force`);
                const [a, b] = joint.points.map((point) => linkage.point(point));
                const turn = joint.axis === undefined ? Math.atan2(b[1] - a[1], b[0] - a[0]) : joint.axis + linkage.bodyPose(linkage.bodyOf[joint.points[0]])[2] + Math.PI / 2;
                found.push({ at: p, v: [force * Math.cos(turn), force * Math.sin(turn)] });
            }
        }
        return found.filter(({ v }) => v.every(Number.isFinite));
    }

    // ---- motion

    play(isPlaying = !this.isPlaying) {
        this.isPlaying = isPlaying;
        const button = $("play");
        button.setAttribute("aria-label", isPlaying ? "Pause" : "Play");
        button.innerHTML = isPlaying ? '<svg viewBox="0 0 20 20"><path class="full" d="M5 3h3.5v14H5zM11.5 3H15v14h-3.5z"/></svg>' : '<svg viewBox="0 0 20 20"><path class="full" d="M5 3v14l12-7z"/></svg>';
        if (!isPlaying) {
            this.write();
            return;
        }
        const { linkage } = this;
        const t = linkage.timeNear(linkage.u);
        linkage.t = t >= linkage.data.run.to - 1e-9 ? linkage.data.run.from : t;
        const law = linkage.shown.driven(linkage.t).u;
        this.glide = linkage.u.map((value, k) => (linkage.data.drivers[k].turns ? value - law[k] - TURN * Math.round((value - law[k]) / TURN) : value - law[k]));
        this.clock = null;
        this.refresh();
    }

    #advance(now) {
        const { linkage } = this;
        const { from, to } = linkage.data.run;
        const elapsed = this.clock === null ? 0 : Math.min((now - this.clock) / 1000, 0.1);
        this.clock = now;
        let t = linkage.t + elapsed * Number($("speed").value);
        if (t > to) {
            t = from + ((t - from) % (to - from));
            if (!this.#repeats()) this.glide = null;
        }
        if (this.glide) {
            this.glide = this.glide.map((gap) => gap * Math.exp(-6 * elapsed));
            if (this.glide.every((gap) => Math.abs(gap) < 1e-9)) this.glide = null;
        }
        if (!linkage.goToTime(t, this.glide)) {
            this.play(false);
            this.blocked = linkage.failure;
        } else this.blocked = "";
    }

    #repeats() {
        return this.linkage.data.drivers.every((driver) => driver.turns);
    }

    // Move a driver to a value, as far as the mechanism goes.
    move(k, value) {
        const u = this.linkage.u.slice();
        u[k] = value;
        this.linkage.t = this.linkage.timeNear(u);
        const isReached = this.linkage.goTowards(u);
        this.blocked = isReached ? "" : this.linkage.failure;
        if (!this.design.isOk && isReached) this.#recovered();
        return isReached;
    }

    #recovered() {
        this.design.ok = this.linkage.setValues(this.design.values);
        if (this.design.ok) this.reshape();
    }

    // Move to a place in a plot.
    pick(over, x) {
        this.play(false);
        this.refresh(() => {
            if (over === "driver") this.move(0, x);
            else this.blocked = this.linkage.goToTime(x) ? "" : this.linkage.failure;
        });
        this.writeSoon();
    }

    // ---- design

    setValue(name, value) {
        this.refresh(() => {
            this.design.set({ [name]: value });
            this.reshape();
        });
    }

    commit() {
        const done = () => {
            this.design.commit();
            this.write();
            this.#readouts();
        };
        if (this.isAsked) requestAnimationFrame(() => requestAnimationFrame(done));
        else done();
    }

    write() {
        const fragment = this.design.fragment();
        this.written = fragment;
        try {
            history.replaceState(null, "", fragment || location.pathname + location.search);
        } catch {
            location.hash = fragment;
        }
    }

    writeSoon() {
        clearTimeout(this.writing);
        this.writing = setTimeout(() => this.write(), 300);
    }

    undo(isRedo = false) {
        if (isRedo ? this.design.redo() : this.design.undo()) {
            this.reshape();
            this.write();
        }
    }

    // ---- parts of the page

    #theme(name) {
        document.documentElement.dataset.theme = name;
        this.theme = THEMES[name];
    }

    #header() {
        const { data } = this.linkage;
        $("name").textContent = breakable(data.name);
        $("title").textContent = data.title;
        $("undo").addEventListener("click", () => this.undo());
        $("redo").addEventListener("click", () => this.undo(true));
        $("reset").addEventListener("click", () => {
            this.design.reset();
            this.reshape();
            this.write();
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
        if (!this.linkage.parameters.some((one) => one.points.length)) $("edit").hidden = true;
    }

    fit() {
        this.view.fit(this.linkage.box());
        this.refresh();
    }

    zoom(factor, at) {
        this.view.zoom(factor, at);
        this.refresh();
    }

    toggleMode() {
        this.mode = this.mode === "move" ? "lengths" : "move";
        $("edit").setAttribute("aria-pressed", String(this.mode === "lengths"));
        if (this.mode === "lengths") this.hint("Drag a pin. Lock values in the panel to keep them.");
        else this.hint("");
    }

    hint(text) {
        $("hint").textContent = text;
        $("hint").hidden = !text;
        clearTimeout(this.hiding);
        if (text) this.hiding = setTimeout(() => ($("hint").hidden = true), 4000);
    }

    #transport() {
        const { linkage } = this;
        const { run, drivers } = linkage.data;
        const speed = $("speed");
        SPEEDS.forEach((value) => speed.append(element("option", { value, textContent: `${value}\u00d7` })));
        const wanted = (run.to - run.from) / Math.min(Math.max(run.to - run.from, 2), LONGEST_PLAY);
        speed.value = SPEEDS.reduce((best, value) => (Math.abs(Math.log(value / wanted)) < Math.abs(Math.log(best / wanted)) ? value : best));
        $("play").addEventListener("click", () => this.play());
        const time = $("time");
        [time.min, time.max] = [run.from, run.to];
        time.addEventListener("input", () => {
            this.play(false);
            this.refresh(() => {
                this.blocked = linkage.goToTime(Number(time.value)) ? "" : linkage.failure;
            });
            this.writeSoon();
        });
        this.sliders = drivers.map((driver, k) => {
            const { unit, factor } = shownUnit(driver.unit);
            const slider = element("input", { type: "range", step: "any", "aria-label": `${driver.name}, slider` });
            const field = element("input", { type: "number", step: "any", "aria-label": `${driver.name} in ${unit}` });
            slider.addEventListener("input", () => {
                this.play(false);
                this.driver = k;
                this.refresh(() => this.move(k, Number(slider.value)));
                this.writeSoon();
            });
            field.addEventListener("change", () => {
                if (field.value.trim() === "" || !Number.isFinite(Number(field.value))) return;
                this.play(false);
                this.refresh(() => this.move(k, Number(field.value) / factor));
                this.writeSoon();
            });
            const label = element("label", { className: "wide" }, element("span", { className: "label", textContent: breakable(driver.name) }), slider);
            $("drivers").append(element("div", { className: "row driver" }, label, field, element("span", { className: "unit", textContent: unit })));
            return { slider, field, factor };
        });
    }

    #ranges() {
        this.sliders.forEach(({ slider }, k) => {
            [slider.min, slider.max] = this.linkage.ranges[k];
        });
    }

    #readouts() {
        const { linkage, design } = this;
        const { run } = linkage.data;
        $("clock").textContent = `${linkage.t.toFixed(run.to - run.from < 10 ? 2 : 1)} s`;
        if (document.activeElement !== $("time") || this.isPlaying) $("time").value = linkage.t;
        this.sliders.forEach(({ slider, field, factor }, k) => {
            const value = this.linkage.wrapped(k);
            if (document.activeElement !== slider || this.isPlaying) slider.value = value;
            if (document.activeElement !== field) field.value = number(value * factor, 6);
        });
        $("undo").disabled = !design.past.length;
        $("redo").disabled = !design.future.length;
        $("reset").disabled = !design.changes().length;
        const banner = $("banner");
        const [head, text] = design.isOk ? ["Stops here. ", this.blocked || ""] : ["Does not close. ", linkage.failure];
        const shown = design.isOk ? (text ? head + text : "") : head + text;
        if (banner.dataset.text !== shown) {
            banner.dataset.text = shown;
            banner.hidden = !shown;
            banner.replaceChildren(element("b", { textContent: head }), document.createTextNode(design.isOk ? text : `${text} The last good pose is shown in grey.`));
        }
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
            if (tab.id === "tab-plots") this.plots.draw();
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

    #resize() {
        const { canvas, view } = this;
        const box = $("stage").getBoundingClientRect();
        const ratio = window.devicePixelRatio || 1;
        [view.width, view.height] = [box.width, box.height];
        [canvas.width, canvas.height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
        if (view.isFitted && this.linkage.pose) view.fit(this.linkage.box());
        this.refresh();
    }

    // ---- hand

    #pointer() {
        const { canvas, view } = this;
        const held = new Map(); // pointers on the canvas
        let drag = null;
        const at = (event) => {
            const box = canvas.getBoundingClientRect();
            return [event.clientX - box.left, event.clientY - box.top];
        };
        const reach = (event) => (event.pointerType === "touch" ? 26 : 13) / view.scale;
        canvas.addEventListener("pointerdown", (event) => {
            canvas.setPointerCapture(event.pointerId);
            held.set(event.pointerId, at(event));
            this.hint("");
            if (held.size === 2) {
                drag = { kind: "pinch" };
                this.held = null;
                return;
            }
            drag = this.#grab(view.plane(at(event)), reach(event)) || { kind: "pan" };
            if (drag.kind !== "pan") this.play(false);
            canvas.classList.add("dragging");
            this.refresh();
        });
        canvas.addEventListener("pointermove", (event) => {
            const p = at(event);
            const before = held.get(event.pointerId);
            if (!before) {
                canvas.classList.toggle("grip", Boolean(this.#grab(view.plane(p), reach(event))));
                return;
            }
            if (drag?.kind === "pinch" && held.size === 2) {
                const [other] = [...held].filter(([id]) => id !== event.pointerId).map(([, place_]) => place_);
                const [was, is] = [before, p].map((one) => Math.hypot(one[0] - other[0], one[1] - other[1]));
                if (was > 0 && is > 0) view.zoom(is / was, [(p[0] + other[0]) / 2, (p[1] + other[1]) / 2]);
                view.pan((p[0] - before[0]) / 2, (p[1] - before[1]) / 2);
                this.refresh();
            } else if (drag?.kind === "pan") {
                view.pan(p[0] - before[0], p[1] - before[1]);
                this.refresh();
            } else if (drag) this.refresh(() => this.#drag(drag, view.plane(p)));
            held.set(event.pointerId, p);
        });
        const release = (event) => {
            held.delete(event.pointerId);
            if (drag?.kind === "pin") this.commit();
            if (drag?.kind === "grip") this.write();
            drag = null;
            this.held = null;
            canvas.classList.remove("dragging");
            this.refresh();
        };
        canvas.addEventListener("pointerup", release);
        canvas.addEventListener("pointercancel", release);
        canvas.addEventListener("wheel", (event) => {
            event.preventDefault();
            this.zoom(Math.exp(-0.0016 * event.deltaY * (event.deltaMode ? 20 : 1)), at(event));
        }, { passive: false });
        canvas.addEventListener("dblclick", (event) => this.#toggleCurve(view.plane(at(event)), reach(event)));
    }

    #grab(p, reach) {
        const { linkage } = this;
        if (this.mode === "lengths") {
            const point = pinAt(linkage, p, reach);
            return point === null ? null : { kind: "pin", point, names: null };
        }
        const grip = gripAt(linkage, p, reach);
        return grip && { kind: "grip", grip };
    }

    #drag(drag, target) {
        const { linkage, design } = this;
        if (drag.kind === "grip") {
            const isReached = pull(linkage, drag.grip, target);
            this.blocked = isReached ? "" : linkage.failure;
            this.held = place(linkage, drag.grip);
            return;
        }
        drag.names ||= parametersOf(linkage, design, drag.point);
        if (!drag.names.length) {
            this.hint("No value that is not locked moves this pin.");
            return;
        }
        const isReached = stretch(linkage, design, drag.point, drag.names, target);
        this.blocked = isReached ? "" : linkage.failure;
        this.held = linkage.point(drag.point);
        this.reshape();
    }

    #toggleCurve(p, reach) {
        const point = pinAt(this.linkage, p, reach);
        if (point === null) return;
        const found = this.drawn.findIndex((one) => one.point === point);
        if (found >= 0) this.drawn.splice(found, 1);
        else this.drawn.push({ point, colour: this.linkage.data.bodies[this.linkage.bodyOf[point]].colour });
        this.traces.delete(point);
        this.reshape();
    }

    #keyboard() {
        const isField = (target) => target.closest?.("input, select, textarea, dialog[open], [role=tab]") || target.tagName === "CANVAS" && target !== this.canvas;
        document.addEventListener("keydown", (event) => {
            const key = event.key.toLowerCase();
            if ((event.ctrlKey || event.metaKey) && (key === "z" || key === "y")) {
                event.preventDefault();
                this.undo(key === "y" || event.shiftKey);
                return;
            }
            if (isField(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
            const { linkage } = this;
            const step = linkage.data.drivers[this.driver]?.kind === "angle" ? Math.PI / 180 : (linkage.ranges[this.driver][1] - linkage.ranges[this.driver][0]) / 200;
            const by = (way) => {
                this.play(false);
                this.refresh(() => this.move(this.driver, linkage.u[this.driver] + way * step * (event.shiftKey ? 10 : 1)));
                this.writeSoon();
            };
            const choose = (way) => {
                const { drivers } = linkage.data;
                this.driver = (this.driver + way + drivers.length) % drivers.length;
                if (drivers.length > 1) this.hint(`Arrow keys move ${drivers[this.driver].name}`);
            };
            const pan = (x, y) => {
                this.view.pan(x, y);
                this.refresh();
            };
            const acts = {
                arrowleft: () => by(-1), arrowright: () => by(1), arrowup: () => choose(-1), arrowdown: () => choose(1),
                home: () => this.pick("time", linkage.data.run.from), "+": () => this.zoom(1.2), "=": () => this.zoom(1.2), "-": () => this.zoom(1 / 1.2),
                f: () => this.fit(), e: () => this.toggleMode(), "?": () => $("keys").showModal(),
                w: () => pan(0, 40), s: () => pan(0, -40), a: () => pan(40, 0), d: () => pan(-40, 0),
            };
            if (event.target === this.canvas || event.target === document.body) acts[" "] = () => this.play();
            const act = acts[key] && ((key.startsWith("arrow") || key === "home") && event.target !== this.canvas && event.target !== document.body ? null : acts[key]);
            if (!act) return;
            event.preventDefault();
            act();
        });
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

// Return a factor for the widths of lines, less than 1 if links are short compared with the linkage.
function fineness(linkage) {
    const lengths = [];
    linkage.data.shapes.forEach((shape) => {
        const points = shape.between || (shape.kind === "link" ? shape.at : []);
        points.slice(1).forEach((point, k) => lengths.push(Math.hypot(...linkage.point(point).map((value, i) => value - linkage.point(points[k])[i]))));
    });
    const [x0, y0, x1, y1] = linkage.box();
    const size = Math.max(x1 - x0, y1 - y0);
    const shortest = Math.min(...lengths.filter((length) => length > 1e-3 * size), size);
    return Math.sqrt(Math.min(Math.max(shortest / (0.12 * size), 0.01), 1));
}

async function start() {
    const data = JSON.parse($("data").textContent);
    try {
        const engines = {};
        for (const [which, part] of Object.entries(data.modules)) {
            engines[which] = part && [await Engine.load(part.text, part), await Engine.load(part.text, part)];
        }
        window.kinfmu = new Page(new Linkage(data, engines));
    } catch (error) {
        $("banner").hidden = false;
        $("banner").textContent = `The mechanism cannot be shown: ${error.message}`;
        throw error;
    }
}

start();
