// Messages of the engine in the words of the page: joints and drivers in place of their rows.

const ROWS = /(?:redundant )?\b(rows?) ([\w.]+(?:, [\w.]+)*) (do not close|does not close|closes?|are dependent)/gi;
const VERBS = { "do not close": "does not close", close: "closes" }; // of several, of one

// Return a message in which "rows C.x, C.y do not close" is "joint C does not close"; drivers: their names.
export function ofJoints(message, drivers = []) {
    return message.replace(ROWS, (_, __, rows, verb) => {
        const owners = [...new Set(rows.split(", ").map((row) => row.split(".")[0]))];
        const kinds = [["joint", owners.filter((name) => !drivers.includes(name))], ["driver", owners.filter((name) => drivers.includes(name))]];
        const named = kinds.filter(([, names]) => names.length).map(([kind, names]) => `${kind}${names.length > 1 ? "s" : ""} ${listed(names)}`).join(" and ");
        if (verb === "are dependent") return `the equations of ${named} are dependent`;
        const [several, one] = Object.entries(VERBS).find((forms) => forms.includes(verb));
        return `${named} ${owners.length > 1 ? several : one}`;
    });
}

function listed(names) {
    return names.length > 1 ? `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}` : names[0];
}
