"use strict";
// The requests of a page to its explorer, and the banner that tells how they go.
(() => {
  const N = window.nsdrill;

  // With the `token` of the explorer, the element `box` for words to the user, and `again()`, the command that starts it again.
  N.asking = function asking(token, box, again) {
    function banner(words) {
      box.textContent = words || "";
      box.hidden = !words;
    }

    let givingUp = null; // the signal for the requests that are made now

    // A banner tells of a request that takes longer than a moment. Where a string is run, its code may have to be compiled.
    let pending = 0, progressBanner = "";
    const PROGRESS = {
      meta: "Opening the file", diagram: "Reading the diagram", plane: "Reading the map", area: "Reading the map", replay: "Running this point again",
      orbit: "Running the motion of this branch", live: "Running on",
      section: "Collecting the returns to the section", saved: "Writing the study",
    };
    const RUNNING = ["replay", "orbit", "live", "section"];
    async function ask(name, request = {}) {
      const showProgress = (words) => {
        if (box.textContent && box.textContent !== progressBanner) return;
        progressBanner = words;
        banner(words);
      };
      const timers = [setTimeout(() => showProgress(`${PROGRESS[name]} …`), 1500)];
      if (RUNNING.includes(name))
        timers.push(setTimeout(() => showProgress(`${PROGRESS[name]} … If this kind of string has not been run on this machine before, its equations are compiled first, which takes a moment; the machine code is kept.`), 6000));
      pending += 1;
      try {
        return await send(name, request);
      } finally {
        timers.forEach(clearTimeout);
        pending -= 1;
        if (!pending && progressBanner && box.textContent === progressBanner) banner("");
      }
    }

    async function send(name, request) {
      let response;
      try {
        response = await fetch(`/api/${name}`, {
          method: "POST", headers: { "X-Nsdrill-Token": token, "Content-Type": "application/json" }, body: JSON.stringify(request),
          signal: givingUp,
        });
      } catch (error) {
        if (error.name === "AbortError") throw error;
        throw new Error(`The explorer does not answer any more. Start it again: ${again()}`);
      }
      if (!response.ok) throw new Error((await response.json()).error);
      if (response.headers.get("Content-Type") === "application/json") return response.json();
      return N.unpack(await response.arrayBuffer());
    }

    // The server counts the page as open as long as this response lasts.
    async function keepAlive() {
      try {
        const response = await fetch("/api/alive", { headers: { "X-Nsdrill-Token": token } });
        if (!response.ok) return;
        const reader = response.body.getReader();
        while (!(await reader.read()).done);
      } catch { /* the banner below tells it */ }
      banner(`The explorer has stopped; what is drawn stays. Start it again: ${again()}`);
    }

    // Runs `work` once at a time; of the calls that come meanwhile only the newest runs next. The requests of a work that takes
    // longer than PATIENCE are then given up, which stops their runs; a shorter one is drawn, or nothing would be while a slider moves.
    const PATIENCE = 1000; // ms
    function latestOnly(work) {
      let busy = false, next = null, stop = null, begun = 0;
      return async function call(...values) {
        if (busy) {
          next = values;
          const late = stop;
          setTimeout(() => late.abort(), Math.max(0, begun + PATIENCE - performance.now()));
          return;
        }
        busy = true;
        stop = new AbortController();
        begun = performance.now();
        try {
          banner("");
          givingUp = stop.signal;
          const done = work(...values); // which makes its requests before it first waits
          givingUp = null;
          await done;
        } catch (error) {
          if (error.name !== "AbortError") banner(error.message);
        }
        busy = false;
        if (next) { const latest = next; next = null; call(...latest); }
      };
    }

    return { banner, ask, keepAlive, latestOnly };
  };
})();
