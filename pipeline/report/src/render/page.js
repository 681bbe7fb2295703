"use strict";
(() => {
  const root = document.documentElement;
  const main = document.getElementById("main");
  const pages = [...document.querySelectorAll("section.page")];
  const experiments = JSON.parse(document.getElementById("experiments").textContent);
  root.classList.add("scripted");

  const make = (name, properties = {}, ...inside) => {
    const element = Object.assign(document.createElement(name), properties);
    element.append(...inside);
    return element;
  };

  // Pages: the hash names one, or something on one.
  const show = (moves) => {
    const id = decodeURIComponent(location.hash.slice(1));
    const target = document.getElementById(id);
    const page = target?.closest("section.page") ?? pages[0];
    for (const p of pages) p.hidden = p !== page;
    prepare(page);
    for (const a of document.querySelectorAll("header nav a")) {
      if (a.hash === "#" + page.id) a.setAttribute("aria-current", "page");
      else a.removeAttribute("aria-current");
    }
    document.title = "zonobench: " + page.dataset.name;
    for (let d = target?.closest("details"); d; d = d.parentElement.closest("details")) d.open = true;
    if (!moves) return;
    if (target && target !== page && page.contains(target)) target.scrollIntoView();
    else scrollTo(0, 0);
    if (target) page.focus({ preventScroll: true });
  };
  addEventListener("hashchange", () => show(true));

  // Dark, light, or as the system has it.
  const themes = ["as the system", "light", "dark"];
  const remembered = () => { try { return localStorage.getItem("zonobench-theme"); } catch { return null; } };
  const remember = (theme) => { try { localStorage.setItem("zonobench-theme", theme); } catch { /* private windows keep nothing */ } };
  const theme = make("button", { type: "button", id: "theme" });
  const setTheme = (name) => {
    if (name === themes[0]) delete root.dataset.theme;
    else root.dataset.theme = name;
    theme.textContent = "Colours: " + name;
  };
  let chosen = themes.includes(remembered()) ? remembered() : themes[0];
  setTheme(chosen);
  theme.addEventListener("click", () => {
    chosen = themes[(themes.indexOf(chosen) + 1) % themes.length];
    remember(chosen);
    setTheme(chosen);
  });

  // Sorting: a body is the unit where there are several (a cell and its readings), else a row.
  const units = (table) => table.tBodies.length > 1 ? [...table.tBodies] : [...table.tBodies[0].rows].filter((r) => !r.matches(".more"));
  const firstRow = (unit) => unit.rows ? unit.rows[0] : unit;
  const key = (unit, column) => (firstRow(unit).cells[column]?.textContent ?? "").trim();
  const asNumber = (text) => {
    const found = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?/i.exec(text);
    return found ? Number(found[0]) : NaN;
  };
  const sort = (table, column, descending) => {
    for (const more of table.querySelectorAll("tr.more")) closeMore(more);
    const keyed = units(table).map((unit) => ({ unit, text: key(unit, column), number: asNumber(key(unit, column)) }));
    keyed.sort((a, b) => {
      // What has no value is last, whichever way.
      if (!a.text || !b.text) return !a.text - !b.text;
      const numeric = !isNaN(a.number) && !isNaN(b.number);
      const order = numeric ? a.number - b.number : a.text.localeCompare(b.text, "en");
      return descending ? -order : order;
    });
    const into = table.tBodies.length > 1 ? table : table.tBodies[0];
    into.append(...keyed.map((k) => k.unit));
  };
  const sortable = (table) => {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((th, column) => {
      const button = make("button", { type: "button" }, ...th.childNodes);
      th.append(button);
      th.setAttribute("aria-sort", "none");
      button.addEventListener("click", () => {
        const descending = th.getAttribute("aria-sort") === "ascending";
        for (const other of heads) other.setAttribute("aria-sort", "none");
        th.setAttribute("aria-sort", descending ? "descending" : "ascending");
        sort(table, column, descending);
      });
    });
  };

  // Filtering by words and by verdict.
  const filtered = (table) => {
    const all = units(table);
    if (all.length < 6) return;
    const caption = table.caption.textContent;
    const words = make("input", { type: "search", size: 18 });
    words.setAttribute("aria-label", "Words to look for in " + caption);
    const verdicts = [...new Set([...table.querySelectorAll(".badge")].map((b) => b.lastChild.textContent.trim()))];
    const verdict = make("select", {}, make("option", { value: "" }, "all verdicts"), ...verdicts.map((v) => make("option", { value: v }, v)));
    verdict.setAttribute("aria-label", "Verdict in " + caption);
    const count = make("span", { className: "muted" });
    count.setAttribute("role", "status");
    const apply = () => {
      const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      for (const unit of all) {
        const text = unit.textContent.toLowerCase();
        const badges = [...unit.querySelectorAll(".badge")].map((b) => b.lastChild.textContent.trim());
        const fits = wanted.every((w) => text.includes(w)) && (!verdict.value || badges.includes(verdict.value));
        unit.hidden = !fits;
        shown += fits;
      }
      count.textContent = shown + " of " + all.length;
    };
    words.addEventListener("input", apply);
    verdict.addEventListener("change", apply);
    apply();
    const controls = make("div", { className: "controls" }, make("label", {}, "Filter ", words));
    if (verdicts.length > 1) controls.append(verdict);
    controls.append(count);
    table.closest(".scroll").before(controls);
  };

  // A page's tables get what works on them when the page is first shown.
  const prepared = new Set();
  const prepare = (page) => {
    if (prepared.has(page)) return;
    prepared.add(page);
    for (const table of page.querySelectorAll("table.sortable")) sortable(table);
    for (const table of page.querySelectorAll("table.filtered")) filtered(table);
    for (const button of page.querySelectorAll("button.exact")) button.setAttribute("aria-expanded", "false");
  };

  // A number: all digits and the run when pointed at, the commands when pressed.
  const tip = make("div", { id: "tip", hidden: true });
  tip.setAttribute("role", "tooltip");
  document.body.append(tip);
  const run = ({ dataset: d }) => {
    if (!d.experiment) return [];
    const [file, seed, runs, steps] = experiments[d.experiment] ?? [];
    const lines = [`experiment ${d.experiment}`];
    if (file) lines.push(`${runs} run${runs === 1 ? "" : "s"}, k = 0 … ${steps}, seed ${seed}`);
    lines.push([d.estimator && `estimator ${d.estimator}`, d.metric && `metric ${d.metric}`, d.component && `component ${d.component}`, d.over && `over ${d.over}`].filter(Boolean).join(", "));
    return lines;
  };
  const hideTip = () => { tip.hidden = true; document.querySelector("[aria-describedby=tip]")?.removeAttribute("aria-describedby"); };
  const showTip = (button) => {
    hideTip();
    tip.textContent = [button.dataset.exact, button.dataset.interval && "interval " + button.dataset.interval, ...run(button)].filter(Boolean).join("\n");
    tip.hidden = false;
    button.setAttribute("aria-describedby", "tip");
    placeTip(button);
  };
  const placeTip = (button) => {
    const at = button.getBoundingClientRect();
    const size = tip.getBoundingClientRect();
    tip.style.left = Math.max(8, Math.min(at.left, innerWidth - size.width - 8)) + "px";
    tip.style.top = (at.bottom + 6 + size.height > innerHeight ? at.top - size.height - 6 : at.bottom + 6) + "px";
  };
  const commands = (button) => {
    const { experiment, estimator, metric, component } = button.dataset;
    const lines = [];
    const [file] = experiments[experiment] ?? [];
    if (!file) return lines;
    lines.push(`zonobench run experiments/${file} --lake lake-one`);
    if (metric === "parameter") {
      lines.push(`# the value of ${component} in experiments/${file}`);
      return lines;
    }
    const [paper, id] = experiment.split("/");
    // Of drop(rmse), ratio(rmse), … the scores are those of rmse, of every estimator.
    const derived = /^\w+\((.*)\)$/.exec(metric);
    let sql = `SELECT estimator, component, n_runs, mean, sd, ci_lo, ci_hi FROM scores WHERE paper = '${paper}' AND experiment = '${id}' AND metric = '${derived ? derived[1] : metric}'`;
    if (!derived && estimator) sql += ` AND estimator = '${estimator}'`;
    if (component) sql += ` AND component = '${component}'`;
    lines.push(`zonobench query "${sql}" --lake lake-one`);
    return lines;
  };
  const closeMore = (more) => {
    more.previousElementSibling?.querySelector("button.exact")?.setAttribute("aria-expanded", "false");
    more.remove();
  };
  const toggleMore = (button) => {
    const row = button.closest("tr");
    const open = row.nextElementSibling;
    if (open?.matches(".more")) return closeMore(open);
    const cell = make("td", { colSpan: row.cells.length }, ...[button.dataset.exact, ...run(button)].map((line) => make("div", {}, line)));
    const lines = commands(button);
    if (lines.length) {
      const pre = make("pre", { className: "sh", tabIndex: 0 }, make("code", {}, lines.join("\n")));
      cell.append(pre);
    }
    row.after(make("tr", { className: "more" }, cell));
    button.setAttribute("aria-expanded", "true");
  };
  const exactOf = (event) => event.target.closest?.("button.exact");
  document.addEventListener("mouseover", (e) => { const b = exactOf(e); if (b) showTip(b); });
  document.addEventListener("mouseout", (e) => { if (exactOf(e)) hideTip(); });
  document.addEventListener("focusin", (e) => { const b = exactOf(e); if (b?.matches(":focus-visible")) showTip(b); });
  document.addEventListener("focusout", (e) => { if (exactOf(e)) hideTip(); });
  document.addEventListener("keydown", (e) => { if (e.key === "Escape") hideTip(); });
  document.addEventListener("click", (e) => { const b = exactOf(e); if (b) { hideTip(); toggleMore(b); } });
  // Moving on to a number with the keyboard may scroll: what is shown of it goes along.
  addEventListener("scroll", () => {
    const button = document.querySelector("[aria-describedby=tip]");
    if (button) placeTip(button);
  }, { passive: true, capture: true });

  // Search over every cell of every paper.
  const search = make("input", { type: "search", id: "search", size: 16, placeholder: "every cell" });
  const found = make("div", { id: "found", hidden: true });
  found.setAttribute("role", "region");
  found.setAttribute("aria-label", "Cells found");
  let index;
  const cells = () => index ??= [...document.querySelectorAll("table.cells")].flatMap((table) => {
    const paper = table.closest("section.page").dataset.name;
    let name = "";
    return [...table.querySelectorAll("tbody tr:not(.more)")].map((row) => {
      if (!row.cells[0].querySelector(".reading")) name = row.cells[0].textContent;
      const text = [paper, table.caption.textContent.replace(/, cell by cell$/, ""), name, ...[...row.cells].slice(1, -1).map((c) => c.textContent.trim())].filter(Boolean).join(" · ");
      return { row, text, lower: (text + " " + row.textContent).toLowerCase() };
    });
  });
  const most = 40;
  const look = () => {
    const wanted = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    found.hidden = !wanted.length;
    if (!wanted.length) return;
    const hits = cells().filter((c) => wanted.every((w) => c.lower.includes(w)));
    const status = make("p", { className: "muted" }, hits.length > most ? `${hits.length} cells, the first ${most} are` : `${hits.length} cell${hits.length === 1 ? "" : "s"}`);
    status.setAttribute("role", "status");
    found.replaceChildren(status, make("ul", {}, ...hits.slice(0, most).map((hit) => {
      const a = make("a", { href: "#" }, hit.text);
      a.addEventListener("click", (e) => { e.preventDefault(); go(hit.row); });
      return make("li", {}, a);
    })));
  };
  const go = (row) => {
    found.hidden = true;
    for (const old of document.querySelectorAll("tr.here")) old.classList.remove("here");
    row.classList.add("here");
    row.hidden = false;
    const body = row.parentElement;
    body.hidden = false;
    const page = row.closest("section.page");
    history.pushState(null, "", "#" + page.id);
    show(false);
    for (let d = row.closest("details"); d; d = d.parentElement.closest("details")) d.open = true;
    row.scrollIntoView({ block: "center" });
    row.querySelector("button.exact")?.focus({ preventScroll: true });
  };
  search.addEventListener("input", look);
  addEventListener("keydown", (e) => {
    if (e.key === "Escape" && !found.hidden) { found.hidden = true; search.focus(); }
  });
  document.addEventListener("click", (e) => { if (!found.contains(e.target) && e.target !== search) found.hidden = true; });

  document.getElementById("tools").append(make("label", {}, "Find ", search), theme);
  // Beside the header: what is found stands in a landmark of its own.
  main.before(found);
  addEventListener("popstate", () => show(false));
  show(true);
})();
