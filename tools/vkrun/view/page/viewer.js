// What the user sees and does: every element of the class "splat" becomes a view of its scene.

// Phones have no full window for elements.
const SPLAT_HELP = "drag: turn · right button or two fingers: move · wheel or pinch: zoom · arrows, + and −: " +
    "the same · space: turn by itself · R: from the start · B: background · " +
    (document.fullscreenEnabled ? "F: full window · " : "") + "H: hide this";
const STEP = 0.1;  // radians, and part of the image, of a key

class SplatViewer {
    constructor(element) {
        this.element = element;
        this.canvas = document.createElement("canvas");
        const gl = this.canvas.getContext("webgl2", {antialias: false, alpha: false, preserveDrawingBuffer: true});
        if (!gl) throw new Error("this browser has no WebGL2");
        this.scene = readScene(element);
        this.camera = new OrbitCamera(this.scene);
        this.background = this.scene.background;
        this.painter = new Painter(gl, this.scene);
        this.sorter = new Sorter(this.scene, order => this.sorted(order), why => showInstead(element, why));
        this.fullPage = element.classList.contains("splat-full");
        this.build();
        this.listen();
        this.turning = this.scene.turning && !matchMedia("(prefers-reduced-motion: reduce)").matches;
        this.remember();
        new ResizeObserver(() => this.change()).observe(this.canvas);
        this.watchPixels();
        // A view that nobody sees draws nothing.
        new IntersectionObserver(entries => {
            this.unseen = !entries[entries.length - 1].isIntersecting;
            if (!this.unseen) this.change();
        }).observe(element);
        this.change();
    }

    // The page is zoomed, or comes to another screen.
    watchPixels() {
        matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", () => {
            this.change();
            this.watchPixels();
        }, {once: true});
    }

    build() {
        const make = (tag, className, textContent) =>
            Object.assign(document.createElement(tag), {className, textContent});
        this.canvas.tabIndex = 0;
        this.canvas.setAttribute("role", "application");  // a screen reader leaves the keys to it
        this.canvas.setAttribute("aria-label", `3D view of ${this.scene.name}. ${SPLAT_HELP}`);
        const bar = make("div", "splat-bar", "");
        const count = number => number.toLocaleString("en");
        const faint = this.scene.faint > 0 ? `, without ${count(this.scene.faint)} that cannot be seen` : "";
        bar.append(make("span", "splat-name", `${this.scene.name} · ${count(this.scene.count)} Gaussians${faint}`));
        const views = make("span", "splat-group", ""), actions = make("span", "splat-group", "");
        const button = (group, text, title, action) => {
            const one = make("button", "", text);
            one.title = title;
            one.onclick = event => {
                action();
                if (event.detail > 0) this.canvas.focus();  // who came by the keyboard stays here
            };
            group.append(one);
        };
        this.scene.poses.forEach((_, i) => button(views, `${i + 1}`, `view ${i + 1}`, () => this.goTo(i)));
        button(actions, "turn", "turn by itself (space)", () => this.toggleTurning());
        if (document.fullscreenEnabled) button(actions, "full", "full window (F)", () => this.fullWindow());
        this.save = make("a", "splat-save", "save .ply");
        this.save.href = "#";
        this.save.download = this.scene.file;
        this.save.onclick = () => this.offerFile();
        actions.append(this.save);
        bar.append(views, actions);  // which wrap as a whole
        const foot = make("div", "splat-foot", "");
        if (this.scene.notes.length > 0) foot.append(make("div", "splat-note", this.scene.notes.join(" ")));
        foot.append(bar);
        this.element.append(this.canvas, foot, make("div", "splat-help", SPLAT_HELP));
        this.element.classList.add("splat-live");
    }

    // The file is made when it is asked for, because it takes as much memory again as the scene.
    offerFile() {
        if (this.file) URL.revokeObjectURL(this.file);
        this.file = URL.createObjectURL(sceneFile(this.scene));
        this.save.href = this.file;
    }

    listen() {
        const canvas = this.canvas, fingers = new Map();
        canvas.onpointerdown = event => {
            canvas.setPointerCapture(event.pointerId);
            fingers.set(event.pointerId, [event.clientX, event.clientY]);
            this.stop();
        };
        canvas.onpointerup = canvas.onpointercancel = event => fingers.delete(event.pointerId);
        canvas.onpointermove = event => {
            const before = fingers.get(event.pointerId);
            if (!before) return;
            const now = [event.clientX, event.clientY], side = Math.min(canvas.clientWidth, canvas.clientHeight);
            const [dx, dy] = [0, 1].map(i => (now[i] - before[i]) / side);
            fingers.set(event.pointerId, now);
            const other = [...fingers].find(([id]) => id !== event.pointerId);
            if (other) {
                const apart = from => Math.hypot(from[0] - other[1][0], from[1] - other[1][1]) + 1;
                this.camera.zoom(apart(before) / apart(now));
                this.camera.pan(dx / 2, dy / 2, canvas.width, canvas.height);
            } else if (event.buttons & 6 || event.shiftKey) {
                this.camera.pan(dx, dy, canvas.width, canvas.height);
            } else {
                this.camera.turn(-Math.PI * dx, Math.PI * dy);
            }
            this.change();
        };
        canvas.oncontextmenu = event => event.preventDefault();
        canvas.addEventListener("wheel", event => {
            // In a page that scrolls the wheel zooms only a view that was clicked.
            if (!this.fullPage && document.activeElement !== canvas) return;
            event.preventDefault();
            this.stop();
            this.camera.zoom(Math.exp(event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.002)));
            this.change();
        }, {passive: false});
        // In a page of several views keys go to the one that was clicked.
        (this.fullPage ? document : canvas).addEventListener("keydown", event => {
            if (!event.target.closest("button, a") && this.key(event.key, event)) event.preventDefault();
        });
        canvas.addEventListener("webglcontextlost", event => {
            event.preventDefault();  // so that it may come back
            showInstead(this.element, "the browser took the graphics device away");
        });
        canvas.addEventListener("webglcontextrestored", () => {
            this.painter = new Painter(this.painter.gl, this.scene);
            this.element.classList.add("splat-live");
            this.place = this.sorter.place = null;
            this.change();
        });
    }

    // Returns whether the key means something.
    key(name, event) {
        if (event.ctrlKey || event.metaKey || event.altKey) return false;
        const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[name];
        if (name >= "1" && name <= "9") {
            if (!this.scene.poses[name - 1]) return false;
            this.goTo(name - 1);
        } else if (arrows) {
            this.stop();
            const {width, height} = this.canvas;
            const [right, down] = arrows.map(v => STEP * v);  // like a drag of the pointer
            if (event.shiftKey) this.camera.pan(right, down, width, height);
            else this.camera.turn(-right, down);
        } else if (name === "+" || name === "=" || name === "-") {
            this.stop();
            this.camera.zoom(name === "-" ? 1 + STEP : 1 / (1 + STEP));
        } else if (name === " ") {
            this.toggleTurning();
        } else if (name === "r" || name === "R") {
            this.goTo(0);
        } else if (name === "b" || name === "B") {
            this.otherBackground();
        } else if ((name === "f" || name === "F") && document.fullscreenEnabled) {
            this.fullWindow();
        } else if (name === "h" || name === "H") {
            this.element.classList.toggle("splat-bare");
        } else {
            return false;
        }
        this.change();
        return true;
    }

    goTo(number) {
        this.stop();
        this.camera.goTo(number);
        this.change();
    }

    stop() { this.turning = false; }

    toggleTurning() {
        this.turning = !this.turning;
        this.slow = this.last = 0;  // who asks for it again gets it
        this.change();
    }

    otherBackground() {
        const other = this.scene.background[0] > 0.5 ? [0, 0, 0] : [1, 1, 1];
        this.background = this.background === this.scene.background ? other : this.scene.background;
    }

    fullWindow() {
        if (document.fullscreenElement) document.exitFullscreen();
        else this.element.requestFullscreen().catch(() => {});  // refused: the view stays as it is
    }

    // A page that reloads itself shows the same view again, and turns on from there. The page of another scene that
    // was written in its place has other poses, and begins anew.
    remember() {
        const number = [...document.querySelectorAll(".splat")].indexOf(this.element);
        const poses = JSON.stringify(this.scene.poses);
        const name = `splat ${location.pathname} ${number}`;
        try {
            const saved = sessionStorage.getItem(name);
            sessionStorage.removeItem(name);
            if (saved) {
                const {camera, turning, other, bare, focus, of} = JSON.parse(saved);
                if (of === poses) {
                    this.camera.restore(camera);
                    this.turning = turning;
                    if (other) this.otherBackground();
                    this.element.classList.toggle("splat-bare", bare);
                    this.controls()[focus]?.focus({preventScroll: true});
                }
            }
            addEventListener("pagehide", () => sessionStorage.setItem(name, JSON.stringify({
                camera: this.camera.save(), turning: this.turning, other: this.background !== this.scene.background,
                bare: this.element.classList.contains("splat-bare"),
                focus: this.controls().indexOf(document.activeElement), of: poses})));
        } catch {}  // a browser that keeps nothing
    }

    controls() {
        return [...this.element.querySelectorAll("canvas, button, a")];
    }

    change() {
        this.element.dataset.state = "drawing";
        if (this.asked || this.unseen) return;
        this.asked = true;
        requestAnimationFrame(time => this.frame(time));
    }

    sorted(order) {
        this.painter.setOrder(order);
        this.change();
    }

    frame(time) {
        this.asked = false;
        const ratio = Math.min(devicePixelRatio, 2);
        const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
        const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
        const sized = this.canvas.width === width && this.canvas.height === height;
        if (!sized) [this.canvas.width, this.canvas.height] = [width, height];
        if (this.turning) this.turnFor(time - (this.last || time));
        this.last = time;
        const view = this.camera.view(width, height);
        this.sorter.sort(view);
        const place = JSON.stringify([view, width, height]);
        this.painter.draw(place === this.place ? null : view, this.background);
        this.place = place;
        if (this.turning) this.change();
        else if (!this.sorter.busy) this.element.dataset.state = "settled";
    }

    // A device that needs long for a frame is not kept busy by a view that turns by itself.
    turnFor(ms) {
        this.slow = ms > 200 ? (this.slow || 0) + 1 : 0;
        if (this.slow > 5) this.stop();
        this.camera.turn(Math.min(0.05, 4e-4 * ms), 0);
    }
}

// The pictures take the place of the view.
function showInstead(element, why) {
    element.classList.remove("splat-live");
    element.querySelector(".splat-why").textContent =
        `The scene does not turn here: ${why}. ` + element.dataset.instead;
}

function startViewers() {
    for (const element of document.querySelectorAll(".splat")) {
        try {
            element.viewer = new SplatViewer(element);
        } catch (error) {
            showInstead(element, error.message);
        }
    }
}
startViewers();
