// A headless Chromium that is told what to do by its DevTools protocol, through a pipe: no package is needed.

import {spawn} from "node:child_process";
import {mkdtempSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {pathToFileURL} from "node:url";

// Software OpenGL ES, whatever the machine has; no sandbox, which root cannot have.
const FLAGS = ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
               "--hide-scrollbars", "--force-device-scale-factor=1", "--no-first-run", "--disable-extensions",
               "--disable-background-networking", "--disable-component-update", "--remote-debugging-pipe"];

export class Browser {
    // program: chromium's; more: flags
    constructor(program, more = []) {
        this.folder = mkdtempSync(join(tmpdir(), "splat-browser-"));
        this.process = spawn(program, [...FLAGS, ...more, `--user-data-dir=${this.folder}`, "about:blank"],
                             {stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"]});
        this.waiting = new Map();
        this.number = 0;
        this.problems = [];  // messages of errors and warnings in the console
        this.requests = [];  // addresses that the pages asked for
        let rest = "";
        this.process.stdio[4].setEncoding("utf8");
        this.process.stdio[4].on("data", text => {
            const parts = (rest + text).split("\0");
            rest = parts.pop();
            for (const part of parts) this.take(JSON.parse(part));
        });
        this.process.on("exit", code => {
            for (const [, reject] of this.waiting.values()) reject(new Error(`chromium ended (${code})`));
        });
    }

    take(message) {
        if (message.id) {
            const [resolve, reject] = this.waiting.get(message.id);
            this.waiting.delete(message.id);
            if (message.error) reject(new Error(message.error.message));
            else resolve(message.result);
        } else if (message.method === "Runtime.consoleAPICalled") {
            const {type, args} = message.params;
            if (type === "error" || type === "warning" || type === "assert")
                this.problems.push(args.map(arg => arg.value ?? arg.description).join(" "));
        } else if (message.method === "Runtime.exceptionThrown") {
            this.problems.push(message.params.exceptionDetails.exception?.description ?? "an exception");
        } else if (message.method === "Log.entryAdded" && ["error", "warning"].includes(message.params.entry.level)) {
            this.problems.push(message.params.entry.text);
        } else if (message.method === "Network.requestWillBeSent") {
            this.requests.push(message.params.request.url);
        }
    }

    send(method, params = {}) {
        return new Promise((resolve, reject) => {
            this.waiting.set(++this.number, [resolve, reject]);
            this.process.stdio[3].write(JSON.stringify({id: this.number, method, params, sessionId: this.session}) + "\0");
        });
    }

    // Attaches to the page of the start.
    async start() {
        const {targetInfos} = await this.send("Target.getTargets");
        const {targetId} = targetInfos.find(target => target.type === "page");
        this.session = (await this.send("Target.attachToTarget", {targetId, flatten: true})).sessionId;
        for (const domain of ["Page", "Runtime", "Log", "Network"]) await this.send(domain + ".enable");
        return this;
    }

    size(width, height, dark = false, deviceScaleFactor = 1) {
        return Promise.all([
            this.send("Emulation.setDeviceMetricsOverride", {width, height, deviceScaleFactor, mobile: false}),
            this.send("Emulation.setEmulatedMedia", {features: [{name: "prefers-color-scheme", value: dark ? "dark" : "light"}]}),
        ]);
    }

    async open(file) {
        await this.send("Page.navigate", {url: pathToFileURL(file).href});
        await this.until('document.readyState === "complete"', 300);
    }

    // The value of an expression, or of the promise that it is.
    async value(expression) {
        const result = await this.send("Runtime.evaluate", {expression, awaitPromise: true, returnByValue: true});
        if (result.exceptionDetails)
            throw new Error(result.exceptionDetails.exception?.description ?? result.exceptionDetails.text);
        return result.result.value;
    }

    async until(expression, seconds) {
        for (const start = Date.now(); Date.now() - start < 1000 * seconds;) {
            if (await this.value(expression).catch(() => false)) return;
            await new Promise(resolve => setTimeout(resolve, 20));
        }
        throw new Error(`not within ${seconds} s: ${expression}`);
    }

    async key(name, more = {}) {
        for (const type of ["keyDown", "keyUp"])
            await this.send("Input.dispatchKeyEvent",
                            {type, key: name, text: type === "keyDown" && name.length === 1 ? name : undefined, ...more});
    }

    mouse(type, x, y, more = {}) {
        return this.send("Input.dispatchMouseEvent", {type, x, y, button: "left", buttons: 1, clickCount: 1, ...more});
    }

    // A PNG, in base64; of the whole page if `whole`.
    async screenshot(whole = false) {
        return (await this.send("Page.captureScreenshot", {format: "png", captureBeyondViewport: whole})).data;
    }

    // dB between two PNGs in base64, over all pixels and colours.
    psnr(a, b) {
        return this.value(`(async () => {
            const pixels = async data => {
                const image = new Image();
                image.src = "data:image/png;base64," + data;
                await image.decode();
                const canvas = new OffscreenCanvas(image.width, image.height), context = canvas.getContext("2d");
                context.drawImage(image, 0, 0);
                return context.getImageData(0, 0, image.width, image.height);
            };
            const [x, y] = [await pixels("${a}"), await pixels("${b}")];
            if (x.width !== y.width || x.height !== y.height)
                throw new Error("sizes differ: " + [x.width, x.height, y.width, y.height]);
            let sum = 0;
            for (let i = 0; i < x.data.length; ++i)
                if (i % 4 !== 3) sum += ((x.data[i] - y.data[i]) / 255) ** 2;
            return 10 * Math.log10(0.75 * x.data.length / Math.max(sum, 1e-12));
        })()`);
    }

    async stop() {
        await this.send("Browser.close").catch(() => {});
        await new Promise(resolve => this.process.exitCode === null ? this.process.on("exit", resolve) : resolve());
        rmSync(this.folder, {recursive: true, force: true, maxRetries: 5});
    }
}
