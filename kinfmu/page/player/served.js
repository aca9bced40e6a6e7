// The page of `kinfmu play`: it follows the file, and asks the server for FMUs and for a copy of the file.

const SERVED = Number(document.documentElement.dataset.version); // of the page
const KEPT = "kinfmu-kept"; // what is shown, across a reload

started.then((page) => {
    if (page) serve(page);
});

async function serve(page) {
    if (page.isEditable) page.editor = await editorOf(page);
    page.linkGallery("gallery");
    takeBack(page);
    if (!page.linkage) page.editor.choose("link");
    const style = "padding: 10px 14px; color: var(--ink); overflow-wrap: anywhere; font-size: 14px; ";
    const line = element("div", { id: "file-problem", role: "alert", hidden: true });
    line.style = `${style}border-bottom: 1px solid var(--bad); background: var(--bad-back)`;
    const busy = element("div", { id: "file-busy", role: "status", hidden: true, textContent: "The file was saved. Its page is being made; until then this is the page before." });
    busy.style = `${style}position: absolute; right: 10px; bottom: 26px; border: 1px solid var(--line); border-radius: 8px; background: var(--panel)`; // over the drawing, which keeps its size
    document.querySelector("header").after(line);
    $("stage").append(busy);
    const tell = (text, isBusy = false) => {
        line.textContent = text;
        line.hidden = !text;
        busy.hidden = !isBusy;
    };
    let buttons = [];
    page.whenTaken = () => (buttons = serverButtons(page));
    if (page.linkage) page.whenTaken();
    let wasBusy = false;
    const states = new EventSource("changes");
    states.addEventListener("state", (event) => {
        const { version, problem, isBusy, editor } = JSON.parse(event.data);
        buttons.forEach((button) => (button.disabled = false));
        const isDrawn = Boolean(page.editor?.sketch);
        if (isDrawn) page.editor.follow(editor, wasBusy && !isBusy);
        else if (version !== SERVED) {
            page.address.write();
            location.reload();
            return;
        }
        wasBusy = isBusy;
        tell(problem && `The file cannot be used as it is: ${problem}`, isBusy && !isDrawn);
    });
    page.whenEnded = () => {
        buttons.forEach((button) => (button.disabled = true));
        tell(`kinfmu play has ended. ${page.editor?.isShown ? "What was drawn until then is kept; start it again to go on." : "This page goes on working; it no longer follows the file."}`);
    };
    states.addEventListener("error", page.whenEnded);
    window.addEventListener("pagehide", () => {
        states.close();
        keep(page);
    });
}

// Return the editor, whose script is packed: pages of many mechanisms stay small.
async function editorOf(page) {
    const [text, names] = EDITOR;
    document.head.append(element("script", { textContent: new TextDecoder().decode(await unpacked(text)) }));
    return new (window.kinfmuEditor(names))(page);
}

// ---- FMU and file

function serverButtons(page) {
    const { linkage, design } = page;
    const part = document.querySelector("#files .buttons");
    const post = async (path) => {
        const answer = await fetch(path, { method: "POST", body: mechanismFile(linkage, design) });
        if (!answer.ok) throw new Error(await answer.text());
        return answer;
    };
    const note = element("p", { className: "quiet", role: "status", id: "served" });
    const add = (label, id, busy, act) => {
        const button = element("button", { textContent: label, id });
        button.addEventListener("click", async () => {
            button.disabled = true;
            note.textContent = busy;
            try {
                note.textContent = await act();
            } catch (error) {
                note.textContent = `Not done: ${error.message}`;
            }
            button.disabled = false;
        });
        part.append(button);
        return button;
    };
    const build = (fmi) => async () => {
        const answer = await post(`fmu${fmi}`);
        download(`${linkage.data.name}.fmu`, await answer.blob(), "application/zip");
        return `Built: ${linkage.data.name}.fmu, FMI ${fmi}.0.`;
    };
    const buttons = [
        add("FMU with the values as set (FMI 3.0)", "save-fmu3", "Building the FMU\u2026", build(3)),
        add("FMU with the values as set (FMI 2.0)", "save-fmu2", "Building the FMU\u2026", build(2)),
        add("Page with the values as set (HTML)", "save-page", "Making the page\u2026", async () => {
            download(`${linkage.data.name}.html`, await (await post("page")).blob(), "text/html");
            return `Made: ${linkage.data.name}.html, which works offline.`;
        }),
        add("Animation of the run (GIF)", "save-gif", "Drawing the animation\u2026", async () => {
            download(`${linkage.data.name}.gif`, await (await post("gif")).blob(), "image/gif");
            return `Made: ${linkage.data.name}.gif.`;
        }),
        add("Pose as shown (DXF)", "save-dxf", "Drawing\u2026", async () => {
            download(`${linkage.data.name}.dxf`, await (await post(`dxf?${[...linkage.u].map((value) => `values=${value}`).join("&")}`)).blob(), "image/vnd.dxf");
            return `Made: ${linkage.data.name}.dxf.`;
        }),
        add("Mechanism file, into the folder of the file", "keep-file", "Saving\u2026", async () => `Saved: ${await (await post("file")).text()}`),
    ];
    part.after(note);
    return buttons;
}

// ---- what stays across a reload, apart from the address

function keep(page) {
    if (page.linkage) page.address.write();
    const { scale, x, y, isFitted } = page.view;
    const tab = document.querySelector("#tabs [aria-selected=true]")?.id;
    const locked = [page.design, page.editor].map((one) => [...(one?.locked || [])]);
    const kept = { at: location.pathname, show: page.show, locked, tab, hasPlots: !$("plots").hidden, isPlaying: page.isPlaying && !page.motion.oncePace, view: isFitted ? null : { scale, x, y, isFitted } };
    try {
        sessionStorage.setItem(KEPT, JSON.stringify(kept));
    } catch {
        // Without storage the address alone stays.
    }
}

function takeBack(page) {
    let kept = null;
    try {
        kept = JSON.parse(sessionStorage.getItem(KEPT));
        sessionStorage.removeItem(KEPT);
    } catch {
        // Without storage there is nothing to take back.
    }
    if (kept?.at !== location.pathname) return; // of another server
    kept.locked[1].forEach((body) => page.editor?.locked.add(body));
    if (!page.linkage) return;
    for (const [name, value] of Object.entries(kept.show)) {
        const box = $(`show-${name}`);
        if (box && box.checked !== value) box.click();
    }
    page.design.lock(kept.locked[0]);
    if (kept.view) Object.assign(page.view, kept.view);
    $(kept.tab)?.click();
    if (kept.hasPlots) $("tab-plots").click();
    page.values.update();
    if (kept.isPlaying) page.motion.play(true);
    page.refresh();
}
