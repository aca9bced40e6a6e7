// The widget of a notebook: the page in a frame. Values and driver values follow both ways.

const PERIOD = 80; // [ms] between two reports while the mechanism moves
const PATIENCE = 20000; // [ms] for the page to start

function render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.title = "Mechanism";
    frame.style = `width: 100%; height: ${model.get("height")}px; border: 1px solid #8886; border-radius: 6px`;
    const resize = () => (frame.style.height = `${model.get("height")}px`);
    model.on("change:height", resize);
    let follow = null;
    frame.addEventListener("load", async () => {
        const page = await started(frame);
        if (page) follow = connect(model, page);
    });
    frame.srcdoc = model.get("page");
    el.append(frame);
    return () => {
        follow?.();
        model.off("change:height", resize);
        frame.remove();
    };
}

// Return the page of a frame; null if it does not start.
async function started(frame) {
    for (const end = Date.now() + PATIENCE; Date.now() < end; ) {
        const page = frame.contentWindow?.kinfmu;
        if (page?.file) return page;
        await new Promise((done) => setTimeout(done, 30));
    }
    return null;
}

// Connect the traits of the model and a page; returns a function that ends it.
function connect(model, page) {
    const { linkage, design } = page;
    const valuesNow = () => Object.fromEntries(design.values);
    const driversNow = () => Object.fromEntries(linkage.data.drivers.map(({ name }, k) => [name, linkage.u[k]]));
    let waiting = 0;
    let filed = null; // values of the file that was last reported
    const report = () => {
        waiting = 0;
        const values = valuesNow();
        if (!same(values, model.get("values"))) model.set("values", values);
        if (!filed || !same(values, filed)) model.set("file", page.file());
        filed = values;
        if (!same(driversNow(), model.get("drivers"))) model.set("drivers", driversNow());
        const problem = page.inWords(design.failure);
        if (problem !== model.get("problem")) model.set("problem", problem);
        model.save_changes();
    };
    const reportSoon = () => (waiting ||= setTimeout(report, PERIOD));

    const paint = page.paint.bind(page);
    page.paint = () => {
        paint();
        reportSoon();
    };
    page.address.write = () => {}; // the notebook has an address of its own

    const takeValues = () => {
        const values = model.get("values");
        if (same(values, valuesNow())) return;
        page.refresh(() => {
            design.set(values);
            design.commit();
            page.reshape();
        }, "values");
    };
    const takeDrivers = () => {
        const drivers = model.get("drivers");
        if (same(drivers, driversNow())) return;
        page.refresh(() => linkage.data.drivers.forEach(({ name }, k) => {
            if (drivers[name] !== linkage.u[k]) page.move(k, drivers[name]);
        }), "drivers");
    };
    const changes = { "change:values": takeValues, "change:drivers": takeDrivers };
    for (const [name, take] of Object.entries(changes)) model.on(name, take);
    page.motion.play(false); // what a page shows when it opens
    takeValues();
    takeDrivers();
    reportSoon();
    return () => {
        clearTimeout(waiting);
        for (const [name, take] of Object.entries(changes)) model.off(name, take);
    };
}

function same(a, b) {
    const names = Object.keys(a);
    return names.length === Object.keys(b || {}).length && names.every((name) => a[name] === b[name]);
}

export default { render };
