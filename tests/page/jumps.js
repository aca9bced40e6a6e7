// Play one cycle of the motion, or the run if it is shorter, in frames of 1/60 s: return the names that jump, appear or vanish. Then
// show all there is in both themes, and return the colours of texts and paper.
() => {
    const k = window.kinfmu;
    const proto = CanvasRenderingContext2D.prototype;
    const write = proto.fillText;
    const colours = new Map(); // of texts, with that of the paper
    let texts = [];
    proto.fillText = function (text, x, y) {
        if (this.canvas === k.canvas && !/^[-\d.e]+$/.test(text)) texts.push({ text: text.replace(/-?[\d.]+°( poor)?/, "°"), x, y });
        if (this.canvas === k.canvas) colours.set(`${this.fillStyle} on ${k.theme.paper}`, [this.fillStyle, k.theme.paper]);
        write.call(this, text, x, y);
    };
    const places = () => k.linkage.data.points.map((_, i) => k.view.pixel(k.linkage.point(i)));
    const { run } = k.linkage.data;
    const speed = k.linkage.data.drivers.length === 1 && k.linkage.data.drivers[0].law === "constant_speed" ? Math.abs(k.linkage.driven(run.from).ud[0]) : 0;
    const whole = Math.min(speed && k.linkage.turns[0] ? (2 * Math.PI * k.linkage.turns[0]) / speed : Infinity, run.to - run.from);
    let now = performance.now() + 1000;
    let [before, points] = [null, places()];
    const found = [];
    let frames = 0;
    k.motion.play(true);
    for (let t = k.linkage.t, past = 0; past < whole && frames < 20000; frames++) {
        texts = [];
        now += 1000 / 60;
        k.frame(now, []);
        past += Math.max(k.linkage.t - t, 0);
        t = k.linkage.t;
        const [seen, is] = [new Map(), places()];
        const moved = Math.max(...is.map((p, i) => Math.hypot(p[0] - points[i][0], p[1] - points[i][1])));
        for (const { text, x, y } of texts) {
            let [key, count] = [text, 1];
            while (seen.has(key)) key = `${text} ${++count}`;
            seen.set(key, [x, y]);
        }
        for (const key of before ? new Set([...seen.keys(), ...before.keys()]) : []) {
            const [a, b] = [before.get(key), seen.get(key)];
            if (!a || !b || Math.hypot(a[0] - b[0], a[1] - b[1]) > 25 + moved) found.push(key);
        }
        [before, points] = [seen, is];
    }
    k.motion.play(false);
    for (const what of Object.keys(k.show)) k.show[what] = true;
    k.frame(now, []);
    document.getElementById("theme").click();
    k.frame(now, []);
    proto.fillText = write;
    return { found, frames, colours: [...colours.values()] };
}
