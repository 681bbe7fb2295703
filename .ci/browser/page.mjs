// Opens the HTML report in a headless Chromium and fails where something is not as it should be:
//
//   node page.mjs INDEX.html [FOLDER FOR SCREENSHOTS]
//
// No error on the console and no request that leaves the file; every link leads to a place, every figure has a
// size; every number of the tables is there; sorting, filtering, the search, the tooltips and the commands work,
// with the keyboard too; axe finds nothing serious, dark and light; the page works without its script.
import { readFileSync, mkdirSync, existsSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [file, shots] = process.argv.slice(2);
const url = pathToFileURL(resolve(file)).href;
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const programs = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
const executablePath = process.env.CHROMIUM ?? programs.find(existsSync);
if (!executablePath) throw new Error(`no Chromium: none of ${programs.join(", ")}, and CHROMIUM is not set`);

let wrong = 0;
const check = (good, what) => {
  console.log(`${good ? "ok   " : "WRONG"} ${what}`);
  if (!good) wrong += 1;
};

const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
const faults = [];
const open = async (options) => {
  const context = await browser.newContext(options);
  const page = await context.newPage();
  page.on("console", (m) => { if (["error", "warning"].includes(m.type())) faults.push(`${m.type()}: ${m.text()}`); });
  page.on("pageerror", (e) => faults.push(`exception: ${e.message}`));
  page.on("request", (r) => { if (!r.url().startsWith("data:") && r.url().split("#")[0] !== url) faults.push(`request: ${r.url()}`); });
  await page.goto(url);
  return page;
};
const places = (page) => page.evaluate(() => [...document.querySelectorAll("section.page")].map((s) => s.id));
const visit = async (page, place) => {
  await page.evaluate((place) => { location.hash = place; }, place);
  await page.waitForFunction((place) => !document.getElementById(place).closest("section.page").hidden, place);
};

const size = statSync(file).size;
check(size < 5e6, `the file has ${(size / 1e6).toFixed(2)} MB, fewer than 5`);

const page = await open({ viewport: { width: 1400, height: 900 }, colorScheme: "light" });
// The least of several: what else the machine does is not the page's.
let ready = Infinity;
for (let i = 0; i < 5 && ready >= 500; i += 1) {
  if (i) await page.reload();
  ready = Math.min(ready, await page.evaluate(() => performance.getEntriesByType("navigation")[0].domContentLoadedEventEnd));
}
console.log(`      it can be used after ${Math.round(ready)} ms`); // a figure, no test: it is the machine's too

const links = await page.evaluate(() => {
  const ids = new Map();
  for (const e of document.querySelectorAll("[id]")) ids.set(e.id, (ids.get(e.id) ?? 0) + 1);
  const hrefs = [...document.querySelectorAll("a[href]")].map((a) => a.getAttribute("href"));
  return {
    twice: [...ids].filter(([, n]) => n > 1).map(([id]) => id),
    broken: hrefs.filter((h) => h.startsWith("#") && !ids.has(decodeURIComponent(h.slice(1)))),
    foreign: hrefs.filter((h) => !h.startsWith("#") && !h.startsWith("https://")),
    number: hrefs.length,
    loads: [...document.querySelectorAll("[src], link[href]")].map((e) => e.getAttribute("src") ?? e.getAttribute("href")).filter((u) => !u.startsWith("data:")),
  };
});
check(links.number > 20 && !links.broken.length, `${links.number} links, broken: ${links.broken.join(", ") || "none"}`);
check(!links.twice.length, `ids that stand twice: ${links.twice.join(", ") || "none"}`);
check(!links.foreign.length && !links.loads.length, `nothing beside the file is loaded or linked: ${[...links.foreign, ...links.loads].join(", ") || "nothing"}`);

const sections = await places(page);
let figures = 0;
for (const place of sections) {
  await visit(page, place);
  const seen = await page.evaluate(() => {
    const page = document.querySelector("section.page:not([hidden])");
    for (const d of page.querySelectorAll("details")) if (d.querySelector("figure")) d.open = true;
    return {
      alone: document.querySelectorAll("section.page:not([hidden])").length === 1,
      wide: document.documentElement.scrollWidth > innerWidth + 1,
      figures: [...page.querySelectorAll("figure > div > svg, figure > svg")].map((s) => ({
        title: s.querySelector("title")?.textContent ?? "",
        size: s.getBoundingClientRect().width * s.getBoundingClientRect().height,
        drawn: s.querySelectorAll("path, circle, rect").length,
      })),
      headings: page.querySelectorAll("h1").length,
      current: document.querySelector("header nav [aria-current]")?.hash === "#" + page.id,
    };
  });
  figures += seen.figures.length;
  check(seen.alone && seen.current && seen.headings === 1, `#${place} is shown alone, under one heading`);
  check(!seen.wide, `#${place} is no wider than the window`);
  const empty = seen.figures.filter((f) => !f.title || f.size < 1e4 || f.drawn < 5);
  check(!empty.length, `#${place}: ${seen.figures.length} figures, empty: ${empty.map((f) => f.title).join(", ") || "none"}`);
}
check(figures > 0 && figures === await page.locator("figure").count(), `${figures} figures, every one drawn`);

const faulty = await page.locator("table.cells .badge.fault").count();
check(faulty === 0, `${faulty} cells in error`);

// Counts of the matrix against the cells on the pages of the papers.
const counted = await page.evaluate(() => [...document.querySelectorAll(".matrix tr")].filter((r) => r.querySelector(".inner")).map((r) => {
  const place = r.querySelector("a").hash.slice(1);
  let at = document.getElementById(decodeURIComponent(place));
  let rows = 0;
  for (at = at.nextElementSibling; at && !/^H[123]$/.test(at.tagName); at = at.nextElementSibling) {
    for (const table of [at, ...at.querySelectorAll("table")].filter((e) => e.matches("table.cells"))) {
      rows += [...table.querySelectorAll("tbody tr")].filter((row) => !row.querySelector("th .reading")).length;
    }
  }
  // Behind the name and the two bars stands a column a verdict.
  return [place, [...r.cells].slice(3).reduce((n, cell) => n + Number(cell.textContent), 0), rows];
}));
const different = counted.filter(([, a, b]) => a !== b);
check(counted.length > 0 && !different.length, `${counted.length} tables of the matrix have as many cells on their pages: ${different.join("; ") || "all"}`);

// Sorting, with the mouse and with the keyboard.
await visit(page, "ranking");
const table = page.locator("section:not([hidden]) table.sortable").first();
const column = (n) => table.evaluate((t, n) => [...t.tBodies[0].rows].map((r) => r.cells[n].textContent.trim()), n);
const name = await table.locator("thead th").nth(4).innerText();
await table.locator("thead th button").nth(4).click();
const up = (await column(4)).map(parseFloat).filter((x) => !isNaN(x));
check(up.length > 1 && up.every((x, i) => !i || up[i - 1] <= x), `sorted by “${name.trim()}”: ${up.join(" ≤ ")}`);
check(await table.locator("thead th").nth(4).getAttribute("aria-sort") === "ascending", "aria-sort says so");
await page.keyboard.press("Enter");
const down = (await column(4)).map(parseFloat).filter((x) => !isNaN(x));
check(down.every((x, i) => !i || down[i - 1] >= x) && down.length === up.length, "Enter turns the order");

// Filtering by words and by verdict; a cell keeps its readings.
const paper = sections.find((s) => s.startsWith("paper-"));
await visit(page, paper);
const cells = page.locator("section:not([hidden]) table.cells.filtered").filter({ has: page.locator("tbody:nth-of-type(7)") }).first();
const region = cells.locator("xpath=..");
const controls = region.locator("xpath=preceding-sibling::*[1]");
const all = await cells.locator("tbody").count();
const word = (await cells.locator("tbody th").first().innerText()).split(/\s+/)[0];
await controls.locator("input").fill(word);
const matching = await cells.locator("tbody").evaluateAll((bodies, word) => bodies.filter((b) => b.textContent.toLowerCase().includes(word.toLowerCase())).length, word);
const visible = await cells.locator("tbody:visible").count();
check(visible === matching && visible > 0 && visible <= all, `filtered by “${word}”: ${visible} of ${all} cells`);
check((await controls.locator("[role=status]").innerText()) === `${visible} of ${all}`, "the count says so");
await controls.locator("input").fill("no such word anywhere");
check(await cells.locator("tbody:visible").count() === 0, "nothing is left for what nothing says");
await controls.locator("input").fill("");
check(await cells.locator("tbody:visible").count() === all, "and all comes back");
if (await controls.locator("select").count()) {
  const verdict = await controls.locator("option").nth(1).getAttribute("value");
  await controls.locator("select").selectOption(verdict);
  const badges = await cells.locator("tbody:visible").evaluateAll((bodies, v) => bodies.every((b) => [...b.querySelectorAll(".badge")].some((x) => x.textContent.includes(v))), verdict);
  check(badges, `filtered by the verdict “${verdict}”`);
  await controls.locator("select").selectOption("");
}

// A number: its digits and its run when pointed at, on focus, and its commands when pressed.
const number = page.locator("section:not([hidden]) button.exact:visible[data-estimator]").first();
const exact = await number.getAttribute("data-exact");
const close = (a, b) => Math.abs(a - b) <= 1e-3 * Math.abs(b);
check(close(Number(await number.innerText()), Number(exact)), `${await number.innerText()} is ${exact}`);
await number.hover();
check((await page.locator("#tip").innerText()).startsWith(exact) && await page.locator("#tip").isVisible(), "the tooltip has every digit and the run");
await page.keyboard.press("Escape");
check(!await page.locator("#tip").isVisible(), "Escape closes it");
await page.mouse.move(0, 0);
await number.focus();
await page.keyboard.press("Shift+Tab");
await page.keyboard.press("Tab");
check(await page.locator("#tip").isVisible() && await number.getAttribute("aria-describedby") === "tip", "so does the keyboard's focus");
await page.keyboard.press("Enter");
const more = await page.locator("tr.more").innerText();
check(/zonobench run experiments\/\S+\.toml/.test(more) && await number.getAttribute("aria-expanded") === "true", "Enter shows the commands");
await page.keyboard.press("Enter");
check(await page.locator("tr.more").count() === 0, "and puts them away");

// The search finds a cell in a click.
await page.locator("#search").fill(`${paper.replace("paper-", "")} ${word}`);
check(await page.locator("#found a").count() > 0, "the search finds cells");
await page.locator("#found a").first().click();
check(await page.locator("tr.here:visible").count() === 1 && !await page.locator("#found").isVisible(), "and goes to the one chosen");
await page.goBack();

// Colours by hand.
const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
const light = await ground();
await page.locator("#theme").click();
check(await ground() === light, "light stays light");
await page.locator("#theme").click();
check(await ground() !== light, "the switch makes it dark");
await page.close();

// axe, once in each colours and width, and screenshots of every page in both.
if (shots) mkdirSync(shots, { recursive: true });
for (const colorScheme of ["light", "dark"]) {
  for (const width of [1400, 390]) {
    const page = await open({ viewport: { width, height: 900 }, colorScheme });
    if (shots) {
      for (const place of sections) {
        await visit(page, place);
        await page.screenshot({ path: join(shots, `${place}-${width}-${colorScheme}.png`) });
      }
    }
    if ((colorScheme === "light") !== (width > 1000)) {
      await page.close();
      continue;
    }
    for (const place of sections) {
      await page.reload();
      await visit(page, place);
      // What is hidden is not looked at and takes axe most of its time.
      await page.evaluate(() => { for (const s of document.querySelectorAll("section.page[hidden]")) s.remove(); });
      await page.evaluate(axe);
      const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
      const serious = found.violations.filter((v) => ["serious", "critical"].includes(v.impact));
      const list = serious.map((v) => `${v.id} (${v.nodes.length}): ${v.nodes[0].target} ${v.nodes[0].failureSummary}`);
      const lesser = found.violations.filter((v) => !serious.includes(v)).map((v) => `${v.id} (${v.impact})`);
      check(!serious.length, `axe, #${place}, ${colorScheme}, ${width}: ${list.join("; ") || "nothing serious"}${lesser.length ? `; lesser: ${lesser.join(", ")}` : ""}`);
    }
    await page.close();
  }
}

// Without the script every page can be read, one below the other.
const plain = await open({ javaScriptEnabled: false });
check(await plain.locator("section.page:visible").count() === sections.length, "without the script all pages are shown");
await plain.close();

check(!faults.length, `console and network: ${faults.join("; ") || "silent"}`);
await browser.close();
console.log(wrong ? `${wrong} wrong` : "all as it should be");
process.exit(wrong ? 1 : 0);
