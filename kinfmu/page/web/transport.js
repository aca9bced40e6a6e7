// The row of play, time and speed, and the sliders of the drivers.

import { decimals, number } from "./numbers.js";
import { $, breakable, element, shownUnit } from "./elements.js";

const SPEEDS = [0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 4];
const STEPS = 100; // of the clock in a run, at least
const LONGEST_PLAY = 8; // [s] of a run at the first speed; longer or shorter runs start at another one
const PLAY = '<svg viewBox="0 0 20 20"><path class="full" d="M5 3v14l12-7z"/></svg>';
const PAUSE = '<svg viewBox="0 0 20 20"><path class="full" d="M5 3h3.5v14H5zM11.5 3H15v14h-3.5z"/></svg>';

export class Transport {
    constructor(page) {
        this.page = page;
        this.linkage = page.linkage;
        const { linkage } = this;
        const { run, drivers } = linkage.data;
        const speed = $("speed");
        const wanted = linkage.hasTime ? (run.to - run.from) / Math.min(Math.max(run.to - run.from, 2), LONGEST_PLAY) : 1;
        const slower = wanted < SPEEDS[0] ? [Number(wanted.toPrecision(1))] : []; // of a run of milliseconds
        const speeds = [...slower, ...SPEEDS];
        speeds.forEach((value) => speed.append(element("option", { value, textContent: `${value}\u00d7` })));
        speed.value = speeds.reduce((best, value) => (Math.abs(Math.log(value / wanted)) < Math.abs(Math.log(best / wanted)) ? value : best));
        document.body.classList.toggle("single", drivers.length === 1);
        $("play").onclick = () => page.motion.play();
        const time = $("time");
        [time.min, time.max] = [run.from, run.to];
        if (!linkage.hasTime) [time.previousElementSibling.textContent, time.ariaLabel] = ["Sample", "Sample"];
        if (linkage.data.over) for (const one of [time.parentElement, $("clock")]) one.hidden = true; // the driver's slider is the axis
        time.oninput = () => {
            page.motion.play(false);
            page.refresh(() => page.motion.arrive(linkage.goToTime(Number(time.value))), "place");
            page.address.writeSoon();
        };
        this.sliders = drivers.map((driver, k) => {
            const { unit, factor } = shownUnit(driver.unit);
            const slider = element("input", { type: "range", step: "any", "aria-label": `${driver.name}, slider` });
            const field = element("input", { type: "number", step: "any", "aria-label": `${driver.name} in ${unit}` });
            slider.addEventListener("input", () => {
                page.motion.play(false);
                page.driver = k;
                page.refresh(() => page.move(k, Number(slider.value)), `driver ${k}`);
                page.address.writeSoon();
            });
            field.addEventListener("change", () => {
                if (field.value.trim() === "" || !Number.isFinite(Number(field.value))) return;
                page.motion.play(false);
                page.refresh(() => page.move(k, Number(field.value) / factor));
                page.address.writeSoon();
            });
            const label = element("label", { className: "wide" }, element("span", { className: "label", textContent: breakable(driver.name) }), slider);
            $("drivers").append(element("div", { className: "row driver" }, label, field, element("span", { className: `unit${unit === "deg" ? " angle" : ""}`, textContent: unit })));
            return { slider, field, factor };
        });
    }

    get speed() {
        return Number($("speed").value);
    }

    // Return by how much the time, or the number of the sample, grows in a second.
    get pace() {
        const { run } = this.linkage.data;
        return this.speed * (this.linkage.hasTime ? 1 : (run.to - run.from) / LONGEST_PLAY);
    }

    showPlaying(isPlaying) {
        $("play").setAttribute("aria-label", isPlaying ? "Pause" : "Play");
        $("play").innerHTML = isPlaying ? PAUSE : PLAY;
    }

    // Take over the ranges of the drivers.
    setRanges() {
        this.sliders.forEach(({ slider }, k) => {
            [slider.min, slider.max] = this.linkage.ranges[k];
        });
    }

    // Return time and driver values in words.
    pose() {
        const { data } = this.linkage;
        const values = this.sliders.map(({ field }, k) => `${data.drivers[k].name} = ${field.value} ${shownUnit(data.drivers[k].unit).unit}`);
        return [...values, ...(data.over ? [] : [$("clock").textContent])].join(", ");
    }

    // Show time and driver values.
    update() {
        const { linkage } = this;
        const { isPlaying } = this.page.motion;
        const { run } = linkage.data;
        $("clock").textContent = linkage.hasTime ? `${linkage.t.toFixed(Math.max(decimals(run.to - run.from, STEPS), 1))} s` : `sample ${Math.round(linkage.t)}`;
        if (document.activeElement !== $("time") || isPlaying) $("time").value = linkage.t;
        this.sliders.forEach(({ slider, field, factor }, k) => {
            const value = linkage.wrapped(k);
            if (document.activeElement !== slider || isPlaying) slider.value = value;
            const shown = number(value * factor, 6);
            if (document.activeElement !== field && field.value !== shown) field.value = shown;
        });
    }
}
