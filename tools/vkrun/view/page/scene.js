// The scene in the page: its numbers, its order, its file.

// The payload of scene_payload.h and what the element says of it.
function readScene(element) {
    const scene = JSON.parse(element.dataset.splat);
    const holder = element.querySelector(".splat-data");
    const text = atob(holder.textContent.trim());
    holder.remove();  // the page needs it once
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    scene.texels = new Uint32Array(bytes.buffer);
    return scene;
}

// Runs in a worker. First message: the means; then {row, offset, near}: the numbers of the Gaussians whose
// depth row . mean + offset is over `near`, the farthest first, equal ones by falling number: by depth, or by the
// distance to `eye` if there is one. Radix sort, 2 x 16 bits.
function sorterBody() {
    let means, keys, other, from, to;
    const counts = [new Uint32Array(65536), new Uint32Array(65536)];
    const depth = new Float32Array(1), bits = new Uint32Array(depth.buffer);
    self.onmessage = event => {
        if (event.data.means) {
            means = event.data.means;
            const count = means.length / 3;
            [keys, other, from, to] = [0, 1, 2, 3].map(() => new Uint32Array(count));
            return;
        }
        const {row, offset, near, eye} = event.data;
        let shown = 0;
        for (const list of counts) list.fill(0);
        for (let i = means.length / 3 - 1; i >= 0; --i) {
            depth[0] = row[0] * means[3 * i] + row[1] * means[3 * i + 1] + row[2] * means[3 * i + 2] + offset;
            if (!(depth[0] > near)) continue;
            if (eye) depth[0] = Math.hypot(means[3 * i] - eye[0], means[3 * i + 1] - eye[1], means[3 * i + 2] - eye[2]);
            const key = ~bits[0] >>> 0;  // positive floats are ordered as their bits are
            keys[shown] = key;
            from[shown++] = i;
            ++counts[0][key & 65535];
            ++counts[1][key >>> 16];
        }
        for (const list of counts)
            for (let i = 0, sum = 0; i < 65536; ++i) [list[i], sum] = [sum, sum + list[i]];
        for (let i = 0; i < shown; ++i) {
            const at = counts[0][keys[i] & 65535]++;
            other[at] = keys[i];
            to[at] = from[i];
        }
        for (let i = 0; i < shown; ++i) from[counts[1][other[i] >>> 16]++] = to[i];
        const order = from.slice(0, shown);
        self.postMessage(order, [order.buffer]);
    };
}

// Sorts in a worker; `done` gets the order, or `failed` a reason.
class Sorter {
    constructor(scene, done, failed) {
        this.byDistance = scene.drawn_as.includes("by distance");
        const url = URL.createObjectURL(new Blob(["(" + sorterBody + ")()"], {type: "text/javascript"}));
        this.worker = new Worker(url);
        URL.revokeObjectURL(url);
        this.busy = false;
        this.worker.onmessage = event => {
            this.busy = false;
            done(event.data);
        };
        this.worker.onerror = event => failed(event.message || "the browser runs no worker");
        const means = new Float32Array(scene.texels.buffer.slice(0, 12 * scene.count));
        this.worker.postMessage({means}, [means.buffer]);
    }

    // Sorts anew if the order may differ from that of the call before.
    sort(camera) {
        const order = {row: camera.rotation.slice(6, 9), offset: camera.translation[2], near: 0.2,
                       eye: this.byDistance ? camera.eye : null};
        const place = JSON.stringify(order);
        if (this.busy || place === this.place) return;
        this.place = place;
        this.busy = true;
        this.worker.postMessage(order);
    }
}

// The bytes of a 3DGS .ply file with the Gaussians of the page.
function sceneFile(scene) {
    const {count, degree, texels} = scene, rest = (degree + 1) ** 2 - 1;
    const names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"];
    for (let i = 0; i < 3 * rest; ++i) names.push("f_rest_" + i);
    names.push("opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3");
    const knots = scene.color, shares = code => [code / 8, (code - 8) / 239, (code - 247) / 8];
    const color = code => shares(code).reduce(
        (sum, t, i) => sum + (knots[i + 1] - knots[i]) * Math.min(Math.max(t, 0), 1), knots[0]);
    const mip = scene.drawn_as.includes("antialiased"), linear = scene.drawn_as.includes("linear colours");
    const header = new TextEncoder().encode(
        `ply\nformat binary_little_endian 1.0\n${mip ? "comment SplatRenderMode: mip\n" : ""}` +
        `element vertex ${count}\n` + names.map(name => `property float ${name}\n`).join("") +
        (linear ? "element color_space 1\nproperty uchar color_space\n" : "") + "end_header\n");
    const means = new Float32Array(texels.buffer, 0, 3 * count), signed = new Int8Array(texels.buffer);
    const values = new Float32Array(count * names.length);
    for (let i = 0, o = 0; i < count; ++i) {
        const [scales, rotation, rgba] = texels.subarray(3 * (count + i), 3 * (count + i) + 3);
        for (let c = 0; c < 3; ++c) values[o++] = means[3 * i + c];
        o += 3;  // normals, which are zero
        for (let c = 0; c < 3; ++c)
            values[o++] = (color(rgba >>> 8 * c & 255) - 0.5) / 0.28209479177387814;
        for (let c = 0; c < 3; ++c)
            for (let k = 0; k < rest; ++k) {
                const v = signed[12 * ((2 + (k >> 2)) * count + i) + 3 * (k & 3) + c] / 127;
                const d = k < 3 ? 0 : k < 8 ? 1 : 2, beyond = Math.max(Math.abs(v) - 119 / 127, 0);
                values[o++] = Math.sign(v) * (scene.sh_limit[d] * v * v + scene.sh_beyond[d] * beyond);
            }
        const opacity = Math.min(rgba >>> 24, 254.9) / 255;  // keeps the logit finite
        values[o++] = Math.log(opacity / (1 - opacity));
        for (const part of [(scales & 2047) / 2047, (scales >>> 11 & 2047) / 2047, (scales >>> 22) / 1023])
            values[o++] = scene.log_scale[0] + scene.log_scale[1] * part;
        const q = [0, 10, 20].map(shift => ((rotation >>> shift & 1023) / 511 - 1) * Math.SQRT1_2);
        q.splice(rotation >>> 30, 0, Math.sqrt(Math.max(0, 1 - q[0] ** 2 - q[1] ** 2 - q[2] ** 2)));
        for (const part of q) values[o++] = part;
    }
    const colors = linear ? [new Uint8Array([1])] : [];  // SHARP's element
    return new Blob([header, values, ...colors], {type: "application/octet-stream"});
}
