// Usage: node viewer.mjs CHROMIUM VKRUN TEMP [speed]
//
// The pages of vkrun view in a headless Chromium with software OpenGL ES. Screenshots at three poses against vkrun
// render; pointer, wheel and keys; the file that the page saves; what is left out; a view within a page; graphics
// devices that are lost, browsers without WebGL2. With `speed`: time to load, and frames a second, of 100,000 and of a
// million Gaussians. Every page must load nothing and leave the console empty.

import {execFileSync} from "node:child_process";
import {mkdirSync, readFileSync, rmSync, statSync, writeFileSync} from "node:fs";
import {join} from "node:path";
import {Browser} from "./browser.mjs";

const LEAST_PSNR = 51;  // dB; the pages reach 53 to 58
const SIZE = [480, 360];

const [chromium, vkrun, temp, mode] = process.argv.slice(2);
rmSync(temp, {recursive: true, force: true});
mkdirSync(temp, {recursive: true});
const at = name => join(temp, name);

// Stops at the first that is wrong.
function expect(holds, what) {
    if (!holds) throw new Error(what);
}

function run(...words) {
    return execFileSync(vkrun, words, {encoding: "utf8", stdio: ["ignore", "pipe", "pipe"]});
}

// Numbers from 0 to 1 (mulberry32).
function random(seed) {
    return () => {
        seed = (seed + 0x6d2b79f5) | 0;
        let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
        t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
        return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
    };
}

// A ball's shell of Gaussians, flat ones and needles, with harmonics of a degree. The first `broken` have a NaN,
// the last `stray` are far darker or brighter than all others, or have a far larger harmonic; the last `huge` are huge.
// `opaque`: all are, so that they reach beyond 3 sigma.
function writeScene(path, count, degree, {broken = 0, stray = 0, huge = 0, opaque = false} = {}) {
    const next = random(7 + count + degree), rest = (degree + 1) ** 2 - 1;
    const names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"];
    for (let i = 0; i < 3 * rest; ++i) names.push("f_rest_" + i);
    names.push("opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3");
    const values = new Float32Array(count * names.length), size = Math.log(2 / Math.sqrt(count));
    for (let i = 0, o = 0; i < count; ++i) {
        const z = 2 * next() - 1, angle = 2 * Math.PI * next(), r = (0.7 + 0.3 * next()) * Math.sqrt(1 - z * z);
        const mean = [r * Math.cos(angle), z, r * Math.sin(angle)];
        for (const v of mean) values[o++] = i < broken ? NaN : v;
        for (const v of mean) {
            const usual = 1.5 * v + 0.8 * Math.sin(9 * v) + 0.3 * (next() - 0.5);
            values[o++] = i < count - stray || degree > 0 ? usual : i % 2 ? 20 : -20;
        }
        for (let k = 0; k < 3 * rest; ++k) {
            const usual = 0.3 * (next() - 0.5);
            values[o++] = i < count - stray || k > 0 ? usual : 1000;
        }
        values[o++] = opaque ? 6 : 8 * next() - 4.5;
        for (let k = 0; k < 3; ++k) values[o++] = size + 2 * (next() - 0.6) + (i < count - huge ? 0 : 15);
        for (let k = 0; k < 4; ++k) values[o++] = next() - 0.5;
    }
    const header = `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n` +
        names.map(name => `property float ${name}\n`).join("") + "end_header\n";
    writeFileSync(path, Buffer.concat([Buffer.from(header), Buffer.from(values.buffer)]));
}

const STATE = 'document.querySelector(".splat").dataset.state';
const settled = (browser, seconds = 60) => browser.until(`${STATE} === "settled"`, seconds);
const attribute = (browser, selector) => browser.value(`document.querySelector("${selector}")?.textContent ?? ""`);

function expectQuiet(browser) {
    const strangers = browser.requests.filter(url => !/^(file|data|blob):/.test(url));
    expect(strangers.length === 0, "the page asked for " + strangers);
    expect(browser.problems.length === 0, "the console has: " + browser.problems.join("\n"));
}

const png = path => readFileSync(path).toString("base64");

// Screenshots at three poses against those of vkrun render. Returns the first one and its PSNR.
async function comparePoses(browser, scene, name, background, ...more) {
    const size = SIZE.join("x"), same = ["--size", size, "--background", background, ...more];
    run("render", scene, "--orbit", "3", ...same, "--out", at(name));
    run("view", scene, "--stills", "0", ...same, "--out", at(name + ".html"));
    await browser.size(...SIZE);
    await browser.open(at(name + ".html"));
    await settled(browser);
    await browser.key("h");
    const found = [];
    for (let i = 0; i < 3; ++i) {
        await browser.key(String(i + 1));
        await settled(browser);
        const picture = await browser.screenshot();
        const psnr = await browser.psnr(picture, png(at(`${name}/00${i}.png`)));
        console.log(`${name}, pose ${i + 1}: ${psnr.toFixed(1)} dB against vkrun render`);
        expect(psnr >= LEAST_PSNR, `${psnr} dB, expected ${LEAST_PSNR}`);
        found.push({picture, psnr});
    }
    return found[0];
}

// What --drawn-as says is seen: the page's picture is nearer to that of vkrun render than to a plain one.
async function drawAs(browser, scene, as, ...more) {
    const background = "0.2,0.4,0.6", name = "as-" + as;
    const {picture, psnr} = await comparePoses(browser, scene, name, background, "--drawn-as", as, ...more);
    run("render", scene, "--orbit", "3", "--size", SIZE.join("x"), "--background", background, "--drawn-as", "plain",
        ...more, "--out", at(name + "-plain"));
    const plain = await browser.psnr(picture, png(at(name + "-plain/000.png")));
    expect(plain < psnr - 1, `--drawn-as ${as}: ${psnr} dB, and ${plain} dB against a plain picture`);
}

// What a user does moves the camera as it should and changes the picture, and R brings both back.
async function useIt(browser) {
    const start = await browser.screenshot();
    const camera = () => browser.value(
        '(({eye, axes, distance}) => ({eye, axes, distance}))(document.querySelector(".splat").viewer.camera)');
    const before = await camera();
    // Where the eye goes, to the right and down; by how much the camera turns; how often as far away it is.
    const moved = async () => {
        const after = await camera(), inner = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        const way = after.eye.map((v, i) => v - before.eye[i]);
        return {right: inner(way, before.axes[0]), down: inner(way, before.axes[1]),
                turned: 1 - inner(before.axes[2], after.axes[2]), far: after.distance / before.distance};
    };
    const does = async (what, action, holds) => {
        await action();
        await settled(browser);
        const way = await moved();
        expect(holds(way), `${what} moves the camera by ${JSON.stringify(way)}`);
        const psnr = await browser.psnr(start, await browser.screenshot());
        expect(psnr < 35, `${what} leaves the picture as it is (${psnr} dB)`);
        await browser.key("r");
        await settled(browser);
        const back = await browser.psnr(start, await browser.screenshot());
        expect(back >= LEAST_PSNR, `R after ${what} does not bring the picture back (${back} dB)`);
    };
    const drag = async more => {
        await browser.mouse("mousePressed", 200, 200, more);
        await browser.mouse("mouseMoved", 260, 230, more);
        await browser.mouse("mouseReleased", 260, 230, more);
    };
    const stays = way => way.turned < 1e-9, turns = way => way.turned > 1e-3;
    // What is dragged to the right and down follows the pointer, so the eye goes left and up.
    const follows = way => way.right < 0 && way.down < 0 && way.far === 1;
    await does("a drag", () => drag({}), way => turns(way) && follows(way));
    await does("a drag with the right button", () => drag({button: "right", buttons: 2}), way => stays(way) && follows(way));
    await does("the wheel", () => browser.mouse("mouseWheel", 200, 200, {deltaX: 0, deltaY: 300, button: "none"}),
               way => stays(way) && way.far > 1);
    const finger = (x, y, id) => ({x, y, id});
    await does("two fingers", async () => {
        const touch = (type, touchPoints) => browser.send("Input.dispatchTouchEvent", {type, touchPoints});
        await touch("touchStart", [finger(200, 200, 0), finger(280, 200, 1)]);
        await touch("touchMove", [finger(150, 200, 0), finger(330, 200, 1)]);
        await touch("touchEnd", []);
    }, way => stays(way) && way.far < 1);
    const SHIFT = {modifiers: 8};
    const keys = [
        ["ArrowRight", {}, way => turns(way) && way.right < 0], ["ArrowLeft", {}, way => turns(way) && way.right > 0],
        ["ArrowDown", {}, way => turns(way) && way.down < 0], ["ArrowUp", {}, way => turns(way) && way.down > 0],
        ["ArrowRight", SHIFT, way => stays(way) && way.right < 0], ["ArrowUp", SHIFT, way => stays(way) && way.down > 0],
        ["+", {}, way => stays(way) && way.far < 1], ["-", {}, way => stays(way) && way.far > 1]];
    for (const [key, more, holds] of keys) await does(`the key ${key} ${JSON.stringify(more)}`, async () => {
        for (let i = 0; i < 5; ++i) await browser.key(key, more);
    }, holds);
    await browser.size(...SIZE, false, 2);
    await browser.until('document.querySelector("canvas").width === ' + 2 * SIZE[0], 10);
    await browser.size(...SIZE);
}

// A view that stopped because its frames took too long turns again when it is asked to.
async function turnAgain(browser) {
    await browser.value('document.querySelector(".splat").viewer.slow = 6');
    await browser.value("new Promise(done => setTimeout(done, 300))");
    await browser.key(" ");
    await browser.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))");
    const turning = await browser.value('document.querySelector(".splat").viewer.turning');
    expect(turning, "a view that stopped by itself does not turn any more");
    await browser.key("r");
    await settled(browser);
}

// A page that is loaded again looks the same, and turns on if it turned; one of other views begins anew.
async function loadAgain(browser, name) {
    const again = async () => {
        await browser.value("window.before = true");
        await browser.send("Page.reload");
        await browser.until(`!window.before && ${STATE}`, 60);
    };
    const viewer = member => browser.value(`document.querySelector(".splat").viewer.${member}`);
    const start = await viewer("camera.eye.join()");
    for (let i = 0; i < 5; ++i) await browser.key("ArrowLeft");
    const eye = await viewer("camera.eye.join()");
    expect(eye !== start, "the key ArrowLeft leaves the camera where it is");
    await again();
    expect(await viewer("camera.eye.join()") === eye, "a page that was loaded again shows another view");
    expect(!await viewer("turning"), "a view that stood turns after the page was loaded again");
    const look = () => browser.value(`(() => {
        const {viewer} = document.querySelector(".splat");
        return [viewer.background, viewer.element.classList.contains("splat-bare"), document.activeElement.tagName].join();
    })()`);
    expect(await look() === "1,1,1,true,CANVAS", "a page that was loaded again looks like " + await look());
    await browser.key("b");
    await browser.key("h");
    await browser.value("document.activeElement.blur()");
    await again();
    expect(await look() === "0,0,0,false,BODY", "a page that was loaded again looks like " + await look());
    await browser.value('document.querySelector(".splat button:last-of-type").focus()');
    const button = await browser.value("document.activeElement.textContent");
    await again();
    expect(await browser.value("document.activeElement.textContent") === button, `${button} has lost the focus`);
    await browser.value("document.activeElement.blur()");
    await browser.key(" ");
    await again();
    expect(await viewer("turning"), "a view that turned stands after the page was loaded again");
    run("view", at(name + ".ply"), "--stills", "0", "--elevation", "40", "--overwrite", "--out", at(name + ".html"));
    await again();
    expect(!await viewer("turning"), "another page turns because the one before it did");
    const other = await viewer("camera.eye.join()");
    await browser.key("r");
    await settled(browser);
    expect(await viewer("camera.eye.join()") === other, "another page does not begin with its first view");
}

// The file that the page saves has the same pictures.
async function saveIt(browser, name) {
    const bytes = await browser.value(`(async () => {
        const {viewer} = document.querySelector(".splat");
        viewer.offerFile();
        const file = new Uint8Array(await (await fetch(viewer.file)).arrayBuffer());
        let text = "";
        for (const byte of file) text += String.fromCharCode(byte);
        return btoa(text);
    })()`);
    writeFileSync(at("saved.ply"), Buffer.from(bytes, "base64"));
    run("render", at("saved.ply"), "--orbit", "3", "--size", SIZE.join("x"), "--background", "1,1,1", "--out", at("saved"));
    const psnr = await browser.psnr(png(at("saved/001.png")), png(at(`${name}/001.png`)));
    console.log(`the saved file: ${psnr.toFixed(1)} dB`);
    expect(psnr >= LEAST_PSNR, `the saved file has ${psnr} dB`);
}

async function leaveOut(browser) {
    writeScene(at("broken.ply"), 2000, 1, {broken: 7});
    const facts = JSON.parse(run("view", at("broken.ply"), "--stills", "0", "--most", "500", "--json", "--out", at("broken.html")));
    expect(facts.gaussians === 500, "--most 500 left " + facts.gaussians);
    await browser.open(at("broken.html"));
    await settled(browser);
    const note = await attribute(browser, ".splat-note");
    expect(/^7 of 2000 Gaussians have numbers that are not finite/.test(note), note);
    expect(/The page holds 500 of \d+ Gaussians/.test(note), note);
    await browser.size(340, 300);
    const covered = await browser.value(`[...document.querySelectorAll(".splat-name, .splat-group > *")].filter(one => {
        const {left, top, width, height} = one.getBoundingClientRect();
        return document.elementFromPoint(left + width / 2, top + height / 2) !== one;
    }).map(one => one.textContent).join()`);
    expect(covered === "", "in a narrow window something lies over " + covered);
    const lone = await browser.value(`(() => {
        const rows = Map.groupBy(document.querySelectorAll(".splat-group > *"), one => one.getBoundingClientRect().top);
        return [...rows.values()].filter(row => row.length === 1).map(row => row[0].textContent).join();
    })()`);
    expect(lone === "", "in a narrow window alone in a row is " + lone);
    await browser.size(...SIZE);
    writeScene(at("huge.ply"), 2000, 0, {huge: 1});
    const {notes} = JSON.parse(run("view", at("huge.ply"), "--stills", "0", "--json", "--out", at("huge.html")));
    expect(notes.join().startsWith("1 of the page's 2000 Gaussians are larger than 55 times the scene"), notes.join());
}

// A view in a page of others: it sleeps while nobody sees it, and keys go to it when it has the focus.
async function inPage(browser, picture) {
    run("predict", picture, "--weights", "cars64", "--out", at("predicted"));
    await browser.open(at("predicted/report.html"));
    const viewer = member => browser.value(`document.querySelector(".splat").viewer.${member}`);
    expect(await viewer("turning"), "the view does not turn");
    await browser.value('document.body.style.paddingBottom = "3000px"; scrollTo(0, 3000)');
    await browser.until('document.querySelector(".splat").viewer.unseen', 10);
    let drawn = -1;
    for (let tries = 0; tries < 10 && await viewer("last") !== drawn; ++tries) {  // frames that were under way
        drawn = await viewer("last");
        await browser.value("new Promise(done => setTimeout(done, 500))");
    }
    expect(await viewer("last") === drawn, "a view that nobody sees draws");
    await browser.value("scrollTo(0, 0)");
    await browser.until(`document.querySelector(".splat").viewer.last > ${drawn}`, 10);
    const eye = await viewer("camera.eye.join()");
    await browser.key(" ");
    expect(await viewer("turning"), "a key reaches a view without the focus");
    await browser.value('document.querySelector("canvas").focus()');
    await browser.key("1");
    await settled(browser);
    expect(!await viewer("turning") && await viewer("camera.eye.join()") !== eye, "no key reaches the view");
}

// The pictures take the place of a view whose device is lost, until it comes back.
async function loseDevice(browser, name) {
    await browser.open(at(name + ".html"));
    await settled(browser);
    const before = await browser.screenshot();
    const live = 'document.querySelector(".splat").classList.contains("splat-live")';
    await browser.value(
        '(window.lost = document.querySelector(".splat").viewer.painter.gl.getExtension("WEBGL_lose_context")).loseContext()');
    await browser.until("!" + live, 10);
    const why = await attribute(browser, ".splat-why");
    expect(/^The scene does not turn here: the browser took the graphics device away\./.test(why), why);
    await browser.value("lost.restoreContext()");
    await browser.until(live, 10);
    await settled(browser);
    const psnr = await browser.psnr(before, await browser.screenshot());
    expect(psnr >= LEAST_PSNR, `a device that came back draws another picture (${psnr} dB)`);
    browser.problems = browser.problems.filter(text => !text.includes("CONTEXT_LOST_WEBGL"));  // ours
}

async function withoutWebGl() {
    run("view", at("broken.ply"), "--stills", "2", "--size", "200x150", "--out", at("stills.html"));
    const browser = await new Browser(chromium, ["--disable-3d-apis"]).start();
    try {
        await browser.open(at("stills.html"));
        const why = await attribute(browser, ".splat-why");
        expect(why === "The scene does not turn here: this browser has no WebGL2. The pictures show it.", why);
        const shown = await browser.value('[...document.querySelectorAll(".splat-stills img")].map(i => i.offsetWidth).join()');
        expect(shown === "200,200", "still pictures: " + shown);
        expectQuiet(browser);
    } finally {
        await browser.stop();
    }
}

// finish() returns before the picture is there; reading a pixel of it does not.
const READ = `{
    const {gl} = viewer.painter;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
}`;

async function measure(browser, count) {
    writeScene(at("large.ply"), count, 1);
    run("view", at("large.ply"), "--stills", "0", "--overwrite", "--out", at("large.html"));
    await browser.size(640, 480);
    const start = performance.now();
    await browser.open(at("large.html"));
    await settled(browser, 300);
    await browser.value(`(() => { const {viewer} = document.querySelector(".splat"); ${READ}; })()`);
    const loaded = performance.now() - start;
    const perSecond = await browser.value(`(async () => {
        const {viewer} = document.querySelector(".splat");
        const start = performance.now();
        let frames = 0;
        for (; frames < 100 && performance.now() - start < 10000; ++frames) {
            viewer.camera.turn(0.03, 0);
            viewer.change();
            await new Promise(requestAnimationFrame);
            ${READ};
        }
        return 1000 * frames / (performance.now() - start);
    })()`);
    await settled(browser, 60);
    const megabytes = statSync(at("large.html")).size / 1e6;
    console.log(`${count} Gaussians, degree 1, ${megabytes.toFixed(1)} MB: turns ${(loaded / 1000).toFixed(1)} s after it ` +
                `is opened, ${perSecond.toFixed(1)} frames a second at 640x480`);
}

const browser = await new Browser(chromium).start();
try {
    if (mode === "speed") {
        for (const count of [100000, 1000000]) await measure(browser, count);
    } else {
        for (const degree of [0, 2, 3]) {
            writeScene(at(`shell${degree}.ply`), 20000, degree, {stray: degree === 2 ? 0 : 2});
            await comparePoses(browser, at(`shell${degree}.ply`), `shell${degree}`, degree === 3 ? "1,1,1" : "0.2,0.4,0.6");
        }
        for (const as of ["antialiased", "linear-colours"]) await drawAs(browser, at("shell2.ply"), as);
        writeScene(at("opaque.ply"), 2000, 2, {opaque: true});
        await drawAs(browser, at("opaque.ply"), "3-sigma");
        for (const as of ["by-distance", "by-distance,3-sigma,linear-colours"])
            await drawAs(browser, at("opaque.ply"), as, "--distance", "0.5");
        await browser.open(at("shell3.html"));  // as it was left, without controls
        await settled(browser);
        await browser.key("r");
        await settled(browser);
        await useIt(browser);
        await turnAgain(browser);
        await loadAgain(browser, "shell3");
        await saveIt(browser, "shell3");
        await leaveOut(browser);
        await inPage(browser, at("shell3/000.png"));
        await loseDevice(browser, "shell3");
        await withoutWebGl();
    }
    expectQuiet(browser);
} finally {
    await browser.stop();
}
