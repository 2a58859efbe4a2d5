// Usage: node gltf_viewers.mjs CHROMIUM VKRUN NPM_FOLDER TEMP
//
// Draws a .glb of vkrun convert with Babylon.js and three.js, whose loaders have KHR_gaussian_splatting, in a headless
// Chromium with software OpenGL ES, and compares pixels with what the Gaussians are. NPM_FOLDER holds node_modules.

import {execFileSync} from "node:child_process";
import {mkdirSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {join, resolve} from "node:path";
import {pathToFileURL} from "node:url";
import {Browser} from "./browser.mjs";

const SIDE = 256, FOV = 0.8, EYE = [0, 0, -4];  // looking along +z, in the axes of a .ply: x right, y down
const MOST = 10;  // of 255; the viewers hold harmonics in bytes and blend in 8 bits, and reach 2 (Babylon.js) and 7

const [chromium, vkrun, npm, temp] = process.argv.slice(2);
rmSync(temp, {recursive: true, force: true});
mkdirSync(temp, {recursive: true});

// Means, colours, log scales, rotations w x y z. The fifth is a needle along x and y, turned about z; the last one lies
// behind the one before it.
const HALF = Math.PI / 8, BALL = [-2.2, -2.2, -2.2];
const GAUSSIANS = [
    {mean: [-1, 0, 0], color: [0.9, 0.1, 0.2], log: BALL, q: [1, 0, 0, 0]},
    {mean: [1, 0, 0], color: [0.1, 0.8, 0.2], log: BALL, q: [1, 0, 0, 0]},
    {mean: [0, -1, 0], color: [0.2, 0.3, 0.9], log: BALL, q: [1, 0, 0, 0]},
    {mean: [0.3, 1, 0], color: [0.8, 0.8, 0.1], log: [-1.5, -3.5, -3.5],
     q: [Math.cos(HALF), 0, 0, Math.sin(HALF)]},
    {mean: [0, 0, 0], color: [0.9, 0.2, 0.9], log: BALL, q: [1, 0, 0, 0]},
    {mean: [0, 0, 1], color: [0.1, 0.9, 0.9], log: BALL, q: [1, 0, 0, 0]},
];
const BAND = 0.4886025119029199, CONSTANT = 0.28209479177387814;
// [-y, z, -x][color]
const bands = i => [0, 1, 2].map(k => [0, 1, 2].map(c => 0.25 * Math.sin(1 + 7 * i + 3 * k + c)));

function writePly(path) {
    const names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", ...Array.from({length: 9}, (_, i) => "f_rest_" + i),
                   "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"];
    const rows = GAUSSIANS.map((g, i) => {
        const sh = bands(i), rest = [0, 1, 2].flatMap(color => sh.map(of => of[color]));
        return [...g.mean, ...g.color.map(c => (c - 0.5) / CONSTANT), ...rest, 8, ...g.log, ...g.q].join(" ");
    });
    writeFileSync(path, ["ply", "format ascii 1.0", `element vertex ${GAUSSIANS.length}`,
                         ...names.map(name => "property float " + name), "end_header", ...rows, ""].join("\n"));
}

// The colour of Gaussian i towards the eye, 0 to 255.
function seen(i) {
    const {mean, color} = GAUSSIANS[i];
    const way = mean.map((v, k) => v - EYE[k]), length = Math.hypot(...way), [x, y, z] = way.map(v => v / length);
    const sh = bands(i);
    const band = k => BAND * (-y * sh[0][k] + z * sh[1][k] - x * sh[2][k]);
    return color.map((c, k) => 255 * Math.min(1, Math.max(0, c + band(k))));
}

function pixel([x, y, z]) {
    const focal = SIDE / 2 / Math.tan(FOV / 2), depth = z - EYE[2];
    return [SIDE / 2 + focal * (x - EYE[0]) / depth, SIDE / 2 + focal * (y - EYE[1]) / depth].map(v => Math.floor(v));
}

// What the page of each viewer does with `data`, the .glb as a data URI: it draws, and sets `drawn`. glTF has +X to the
// left, +Y up and +Z forward, so that the eye is where it is among the axes of a .ply.
const VIEWERS = {
    "Babylon.js": {
        packages: ["babylonjs", "babylonjs-loaders"],
        head: ["babylonjs/babylon.js", "babylonjs-loaders/babylonjs.loaders.min.js"],
        kind: "",
        script: `
            const engine = new BABYLON.Engine(canvas, false, {preserveDrawingBuffer: true});
            const scene = new BABYLON.Scene(engine);
            scene.useRightHandedSystem = true;
            scene.clearColor = new BABYLON.Color4(0, 0, 0, 1);
            const camera = new BABYLON.UniversalCamera("eye", new BABYLON.Vector3(${EYE}), scene);
            camera.setTarget(BABYLON.Vector3.Zero());
            camera.fov = ${FOV};
            camera.minZ = 0.1;
            let frames = 0;
            BABYLON.SceneLoader.AppendAsync("", data, scene, undefined, ".glb").then(() =>
                engine.runRenderLoop(() => {
                    scene.render();
                    window.drawn = ++frames > 30;
                }), error => console.error(error.message));`,
    },
    "three.js": {
        packages: ["three"],
        head: [],
        kind: "module",
        script: `
            import * as THREE from "three";
            import {GLTFLoader} from "three/addons/loaders/GLTFLoader.js";
            import {GLTFGaussianSplatLoaderExtension} from "three/addons/loaders/GLTFGaussianSplatLoaderExtension.js";
            const renderer = new THREE.WebGPURenderer({canvas, forceWebGL: true});
            await renderer.init();
            renderer.setSize(${SIDE}, ${SIDE}, false);
            renderer.setClearColor(0, 1);
            // The loader leaves sRGB colours as they are, so they must not be encoded once more.
            renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
            const scene = new THREE.Scene();
            const camera = new THREE.PerspectiveCamera(${FOV * 180 / Math.PI}, 1, 0.1, 100);
            camera.position.set(${EYE});
            camera.lookAt(0, 0, 0);
            const loader = new GLTFLoader();
            loader.register(parser => new GLTFGaussianSplatLoaderExtension(parser));
            scene.add((await loader.loadAsync(data)).scene);
            let frames = 0;
            renderer.setAnimationLoop(() => {
                renderer.render(scene, camera);
                window.drawn = ++frames > 30;
            });`,
    },
};

function writePage(name, glb) {
    const {head, kind, script} = VIEWERS[name], at = file => pathToFileURL(resolve(npm, "node_modules", file)).href;
    const imports = {three: at("three/build/three.webgpu.js"), "three/webgpu": at("three/build/three.webgpu.js"),
                     "three/tsl": at("three/build/three.tsl.js"), "three/addons/": at("three/examples/jsm") + "/"};
    const page = join(temp, name + ".html");
    writeFileSync(page, `<!doctype html><meta charset="utf-8"><style>body { margin: 0; background: black }</style>
        <canvas id="canvas" width="${SIDE}" height="${SIDE}" style="display: block"></canvas>
        <script type="importmap">${JSON.stringify({imports})}</script>
        ${head.map(file => `<script src="${at(file)}"></script>`).join("\n")}
        <script>const canvas = document.getElementById("canvas"), data = "data:;base64,${glb}";</script>
        <script type="${kind}">${script}</script>`);
    return page;
}

// The colours of pixels of a PNG in base64.
function colors(browser, png, places) {
    return browser.value(`(async () => {
        const image = new Image();
        image.src = "data:image/png;base64,${png}";
        await image.decode();
        const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
        context.drawImage(image, 0, 0);
        return ${JSON.stringify(places)}.map(([x, y]) => [...context.getImageData(x, y, 1, 1).data].slice(0, 3));
    })()`);
}

async function check(browser, name, glb) {
    await browser.size(SIDE, SIDE);
    await browser.open(writePage(name, glb));
    await browser.until("window.drawn", 120).catch(error => {
        throw new Error(`${name}: ${error.message}\n${browser.problems.join("\n")}`);
    });
    const needle = GAUSSIANS[3].mean, side = 0.2 * Math.SQRT1_2;
    const places = [
        ...[0, 1, 2, 3, 4].map(i => ({what: `Gaussian ${i}`, at: GAUSSIANS[i].mean, color: seen(i)})),
        {what: "along the needle", at: [needle[0] + side, needle[1] + side, 0], needle: true},
        {what: "against the needle", at: [needle[0] - side, needle[1] - side, 0], needle: true},
        {what: "beside the needle", at: [needle[0] + side, needle[1] - side, 0], color: [0, 0, 0]},
        {what: "where nothing is", at: [0.5, -0.5, 0], color: [0, 0, 0]},
    ];
    // A viewer sorts in a worker and fits its canvas to the window when it likes: the picture counts that stays.
    let png, last, tries = 0;
    do {
        if (++tries > 60) throw new Error(`${name}: the picture does not settle`);
        last = png;
        await new Promise(done => setTimeout(done, 500));
        png = await browser.screenshot();
    } while (png !== last);
    writeFileSync(join(temp, name + ".png"), Buffer.from(png, "base64"));
    const found = await colors(browser, png, places.map(place => pixel(place.at)));
    let worst = 0;
    places.forEach(({what, color, needle}, i) => {
        const shown = found[i].join(", ");
        if (needle) {
            if (!(found[i][0] > 60 && found[i][1] > 60)) throw new Error(`${name}, ${what}: ${shown}, expected yellow`);
            return;
        }
        const off = Math.max(...color.map((v, k) => Math.abs(v - found[i][k])));
        worst = Math.max(worst, off);
        if (off > MOST)
            throw new Error(`${name}, ${what}: ${shown}, expected ${color.map(Math.round).join(", ")}; ` +
                            `all: ${found.map(color => color.join(" ")).join(", ")}`);
    });
    const versions = VIEWERS[name].packages.map(folder => {
        const {version} = JSON.parse(readFileSync(join(npm, "node_modules", folder, "package.json")));
        return `${folder} ${version}`;
    });
    console.log(`${versions.join(", ")}: ${places.length} places, colours within ${worst.toFixed(1)} of 255`);
}

writePly(join(temp, "scene.ply"));
execFileSync(vkrun, ["convert", join(temp, "scene.ply"), join(temp, "scene.glb")], {stdio: "inherit"});
const glb = readFileSync(join(temp, "scene.glb")).toString("base64");
const browser = await new Browser(chromium, ["--allow-file-access-from-files"]).start();
try {
    for (const name of Object.keys(VIEWERS)) await check(browser, name, glb);
} finally {
    await browser.stop();
}
