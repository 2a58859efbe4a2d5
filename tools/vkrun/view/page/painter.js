// Draws Gaussians with WebGL2 as the rasterizer does in the 3dgs convention (shaders/raster/): dilation of 0.3
// pixels^2, alpha at most 0.99, skipped below 1/255 and outside of the tiles that the square of 3 standard deviations
// meets, depth over 0.2. Blended back to front in half floats. Not the same: a pixel does not stop at a transmittance of 1e-4.
// The scene's `drawn_as` decides, as SPLAT_DRAWN_ bits do: compensated opacities, the cut at 3 sigma, linear colours.

// Two passes: every Gaussian is projected into two texels, once for a position of the camera; then quads are drawn in
// the order of depth. Instances of many quads, because software devices draw every instance by itself.

const ROW = 2048;      // texels of a row of all textures
const QUADS = 1024;    // quads of an instance

const SPLAT_RECTANGLE = `#version 300 es
void main() { gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1); }`;

const SPLAT_PROJECT = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D texels;     // planes of count texels, rows of 2048: see scene_payload.h
uniform int count, degree;
uniform mat3 rotation;         // world to camera
uniform vec3 translation, eye;
uniform vec4 intrinsics;       // fx fy cx cy, pixels
uniform vec2 size, logScale;   // logScale: least value, extent
uniform vec4 color;            // values of the codes 0, 8, 247 and 255
uniform mat3x2 sh;             // limit and beyond of degrees 1 to 3
uniform bool antialiased;      // opacities compensate for the dilation
layout(location = 0) out uvec4 first;   // middle, l11, l21: alpha = opacity exp2(-|L^T q|^2)
layout(location = 1) out uvec4 second;  // l22, opacity (0: not seen), colour and half size of the square, halves
int item;

uvec3 texel(int plane) {
    int t = plane * count + item;
    return texelFetch(texels, ivec2(t & 2047, t >> 11), 0).xyz;
}

float shade(uint code) {
    vec3 share = clamp((float(code) - vec3(0, 8, 247)) / vec3(8, 239, 8), 0.0, 1.0);
    return color.x + dot(share, color.yzw - color.xyz);
}

vec3 coefficient(uvec3 words, int k, vec2 limits) {
    vec3 code;
    for (int c = 0; c < 3; ++c) {
        int at = 3 * k + c;
        code[c] = float(int(words[at >> 2] << (24 - 8 * (at & 3))) >> 24);
    }
    vec3 v = code / 127.0;
    return sign(code) * (limits.x * v * v + limits.y * max(abs(code) - 119.0, 0.0) / 127.0);
}

vec3 harmonics(vec3 d) {
    float x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z;
    vec3 sum = vec3(0);
    if (degree == 0) return sum;
    uvec3 w = texel(2);
    sum += 0.4886025119029199 * (-y * coefficient(w, 0, sh[0]) + z * coefficient(w, 1, sh[0]) -
                                 x * coefficient(w, 2, sh[0]));
    if (degree == 1) return sum;
    sum += 1.0925484305920792 * x * y * coefficient(w, 3, sh[1]);
    w = texel(3);
    sum += -1.0925484305920792 * y * z * coefficient(w, 0, sh[1]) +
           0.31539156525252005 * (2.0 * zz - xx - yy) * coefficient(w, 1, sh[1]) -
           1.0925484305920792 * x * z * coefficient(w, 2, sh[1]) +
           0.5462742152960396 * (xx - yy) * coefficient(w, 3, sh[1]);
    if (degree == 2) return sum;
    w = texel(4);
    sum += -0.5900435899266435 * y * (3.0 * xx - yy) * coefficient(w, 0, sh[2]) +
           2.890611442640554 * x * y * z * coefficient(w, 1, sh[2]) -
           0.4570457994644658 * y * (4.0 * zz - xx - yy) * coefficient(w, 2, sh[2]) +
           0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy) * coefficient(w, 3, sh[2]);
    w = texel(5);
    return sum - 0.4570457994644658 * x * (4.0 * zz - xx - yy) * coefficient(w, 0, sh[2]) +
           1.445305721320277 * z * (xx - yy) * coefficient(w, 1, sh[2]) -
           0.5900435899266435 * x * (xx - 3.0 * yy) * coefficient(w, 2, sh[2]);
}

mat3 quaternionMatrix(uint word) {
    vec3 v = (vec3(word & 1023u, word >> 10 & 1023u, word >> 20 & 1023u) / 511.0 - 1.0) * 0.7071067811865476;
    float rest = sqrt(max(0.0, 1.0 - dot(v, v)));
    uint largest = word >> 30;
    vec4 q = largest == 0u ? vec4(rest, v) : largest == 1u ? vec4(v.x, rest, v.yz)
           : largest == 2u ? vec4(v.xy, rest, v.z) : vec4(v, rest);
    float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
                2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
                2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

void main() {
    first = second = uvec4(0);
    item = int(gl_FragCoord.y) * 2048 + int(gl_FragCoord.x);
    if (item >= count) return;
    vec3 mean = uintBitsToFloat(texel(0));
    vec3 m = rotation * mean + translation;
    if (!(m.z > 0.2)) return;
    uvec3 words = texel(1);
    vec3 scale = exp(logScale.x + logScale.y * vec3(words.x & 2047u, words.x >> 11 & 2047u, words.x >> 22) /
                     vec3(2047, 2047, 1023));
    float opacity = float(words.z >> 24) / 255.0;
    vec3 constant = vec3(shade(words.z & 255u), shade(words.z >> 8 & 255u), shade(words.z >> 16 & 255u));

    // Projection: shaders/include/projection.glsl.
    vec2 limit = 0.65 * size / intrinsics.xy;
    vec2 ratio = clamp(m.xy / m.z, -limit, limit);
    mat3 rows = transpose(rotation);
    mat3 rq = quaternionMatrix(words.y);
    vec3 v1 = (intrinsics.x / m.z * (rows[0] - ratio.x * rows[2])) * rq * scale;
    vec3 v2 = (intrinsics.y / m.z * (rows[1] - ratio.y * rows[2])) * rq * scale;
    float a0 = dot(v1, v1), c0 = dot(v2, v2), b = dot(v1, v2);
    vec3 n = cross(v1, v2);
    float det = dot(n, n) + 0.3 * (a0 + c0) + 0.09, a = a0 + 0.3, c = c0 + 0.3;
    if (antialiased) opacity *= max(0.005, sqrt(dot(n, n) / det));
    vec2 middle = intrinsics.xy * m.xy / m.z + intrinsics.zw;
    vec3 l = 0.849321800288 * vec3(sqrt(c / det), -b / sqrt(c * det), inversesqrt(c));
    float half_gap = 0.5 * (a - c);
    float radius = ceil(3.0 * sqrt(0.5 * (a + c) + sqrt(max(0.1, half_gap * half_gap + b * b))));
    vec3 seen = max(constant + harmonics(normalize(mean - eye)), vec3(0));
    first = floatBitsToUint(vec4(middle, l.xy));
    second = uvec4(floatBitsToUint(vec2(l.z, opacity)), packHalf2x16(seen.rg),
                   packHalf2x16(vec2(seen.b, min(radius, 65504.0))));
}`;

const SPLAT_VERTEX = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D order, firsts, seconds;
uniform int shown;
uniform vec2 size;
uniform float reach;  // most |L^T q|^2
flat out vec4 shape;  // l11 l21 l22 opacity
flat out vec2 middle;
flat out vec3 shade;

ivec2 place(int t) { return ivec2(t & 2047, t >> 11); }

void main() {
    gl_Position = vec4(0, 0, 2, 1);  // outside
    int rank = 1024 * gl_InstanceID + (gl_VertexID >> 2);
    if (rank >= shown) return;
    ivec2 at = place(int(texelFetch(order, place(rank), 0).x));
    uvec4 second = texelFetch(seconds, at, 0);
    float opacity = uintBitsToFloat(second.y);
    if (!(opacity > 0.0)) return;
    vec4 first = uintBitsToFloat(texelFetch(firsts, at, 0));
    vec2 blue = unpackHalf2x16(second.w);
    middle = first.xy;
    shape = vec4(first.zw, uintBitsToFloat(second.x), opacity);
    shade = vec3(unpackHalf2x16(second.z), blue.x);

    // The ellipse alpha >= 1/255 or 3 sigma, within the tiles of 16 pixels that the 3dgs square meets.
    float root = sqrt(clamp(log2(255.0 * opacity), 0.0, reach) + 4e-3);
    vec2 extent = vec2(root * length(shape.yz) / (shape.x * shape.z), root / shape.z);
    vec2 u = middle - 0.5, tiles = ceil(size / 16.0);
    vec2 low = 16.0 * trunc(clamp((u - blue.y) / 16.0, vec2(0), tiles));
    vec2 high = 16.0 * trunc(clamp((u + blue.y + 15.0) / 16.0, vec2(0), tiles));
    low = max(low, middle - extent);
    high = min(high, middle + extent);
    if (any(greaterThanEqual(low, high))) return;
    vec2 corner = mix(low, high, vec2(gl_VertexID & 1, gl_VertexID >> 1 & 1));
    gl_Position = vec4(2.0 * corner.x / size.x - 1.0, 1.0 - 2.0 * corner.y / size.y, 0, 1);
}`;

const SPLAT_FRAGMENT = `#version 300 es
precision highp float;
uniform vec2 size;
uniform float reach;
flat in vec4 shape;
flat in vec2 middle;
flat in vec3 shade;
out vec4 result;
void main() {
    vec2 q = middle - vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
    float u = shape.x * q.x + shape.y * q.y, v = shape.z * q.y;
    float power = u * u + v * v, alpha = min(0.99, shape.w * exp2(-power));
    if (alpha < 0.00392156886 || power > reach) discard;
    result = vec4(alpha * shade, alpha);
}`;

// Linear colours as sRGB (IEC 61966-2-1).
const SPLAT_SHOW = `#version 300 es
precision highp float;
uniform highp sampler2D frame;
out vec4 result;
void main() {
    vec3 v = texelFetch(frame, ivec2(gl_FragCoord.xy), 0).rgb, low = vec3(0.0031308);
    result = vec4(mix(1.055 * pow(max(v, low), vec3(1.0 / 2.4)) - 0.055, 12.92 * v, lessThanEqual(v, low)), 1);
}`;

const linear = v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;

class Painter {
    // scene: of readScene(). Throws an Error with a sentence.
    constructor(gl, scene) {
        this.gl = gl;
        this.scene = scene;
        this.shown = 0;
        this.halves = gl.getExtension("EXT_color_buffer_float") || gl.getExtension("EXT_color_buffer_half_float");
        this.projecting = this.link(SPLAT_RECTANGLE, SPLAT_PROJECT);
        this.drawing = this.link(SPLAT_VERTEX, SPLAT_FRAGMENT);
        const says = name => scene.drawn_as.includes(name);
        this.antialiased = says("antialiased");
        this.reach = says("3 sigma") ? 6.49212769 : 128;  // 9/2 log2(e); else no limit
        this.showing = says("linear colours") ? this.link(SPLAT_RECTANGLE, SPLAT_SHOW) : null;
        this.rows = Math.max(1, Math.ceil(scene.count / ROW));
        this.scenes = this.texture(gl.RGB32UI, ROW, Math.ceil(scene.texels.length / 3 / ROW));
        this.fill(this.scenes, gl.RGB_INTEGER, scene.texels, 3);
        this.order = this.texture(gl.R32UI, ROW, this.rows);
        this.projected = [0, 1].map(() => this.texture(gl.RGBA32UI, ROW, this.rows));
        this.projection = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.projection);
        const attachments = [gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1];
        attachments.forEach((attachment, i) =>
            gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, this.projected[i], 0));
        gl.drawBuffers(attachments);
        const corners = new Uint16Array(6 * QUADS);
        for (let i = 0; i < 6 * QUADS; ++i) corners[i] = 4 * Math.floor(i / 6) + [0, 1, 2, 2, 1, 3][i % 6];
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    }

    // A program with the places of its uniforms.
    link(...texts) {
        const gl = this.gl, program = gl.createProgram();
        [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].forEach((type, i) => {
            const shader = gl.createShader(type);
            gl.shaderSource(shader, texts[i]);
            gl.compileShader(shader);
            gl.attachShader(program, shader);
        });
        gl.linkProgram(program);
        if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
            throw new Error("the shaders do not compile here: " + gl.getProgramInfoLog(program));
        return {program, at: name => gl.getUniformLocation(program, name)};
    }

    texture(format, width, rows) {
        const gl = this.gl, most = gl.getParameter(gl.MAX_TEXTURE_SIZE), texture = gl.createTexture();
        if (rows > most) throw new Error(`the scene needs a texture of ${rows} rows, and this device has ${most}`);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
            gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
        gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, Math.max(1, rows));
        return texture;
    }

    // The first texels of a texture, of so many words each.
    fill(texture, format, words, channels) {
        const gl = this.gl, texels = words.length / channels, whole = Math.floor(texels / ROW);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        const part = (row, width, height) => gl.texSubImage2D(
            gl.TEXTURE_2D, 0, 0, row, width, height, format, gl.UNSIGNED_INT,
            words.subarray(channels * ROW * row, channels * (ROW * row + width * height)));
        if (whole > 0) part(0, ROW, whole);
        if (texels > whole * ROW) part(whole, texels - whole * ROW, 1);
    }

    // Numbers of Gaussians, the farthest first.
    setOrder(order) {
        this.fill(this.order, this.gl.RED_INTEGER, order, 1);
        this.shown = order.length;
    }

    // A target of half floats of the canvas's size; where the device cannot blend into one, none, or for linear colours
    // one of bytes.
    target(width, height) {
        const gl = this.gl;
        if (!this.halves && !this.showing) return null;
        if (this.frame && this.width === width && this.height === height) return this.frame;
        gl.deleteTexture(this.pixels || null);
        gl.deleteFramebuffer(this.frame || null);
        [this.width, this.height] = [width, height];
        this.pixels = this.texture(this.halves ? gl.RGBA16F : gl.RGBA8, width, height);
        this.frame = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.pixels, 0);
        if (!this.halves || gl.checkFramebufferStatus(gl.FRAMEBUFFER) === gl.FRAMEBUFFER_COMPLETE) return this.frame;
        this.halves = this.frame = null;
        return this.target(width, height);
    }

    project(camera) {
        const gl = this.gl, scene = this.scene, {program, at} = this.projecting;
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.projection);
        gl.viewport(0, 0, ROW, this.rows);
        gl.disable(gl.BLEND);
        gl.useProgram(program);
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, this.scenes);
        gl.uniform1i(at("count"), scene.count);
        gl.uniform1i(at("degree"), scene.degree);
        gl.uniformMatrix3fv(at("rotation"), true, camera.rotation);
        gl.uniform3fv(at("translation"), camera.translation);
        gl.uniform3fv(at("eye"), camera.eye);
        gl.uniform4fv(at("intrinsics"), camera.intrinsics);
        gl.uniform2f(at("size"), gl.canvas.width, gl.canvas.height);
        gl.uniform2fv(at("logScale"), scene.log_scale);
        gl.uniform4fv(at("color"), scene.color);
        gl.uniform1i(at("antialiased"), this.antialiased);
        gl.uniformMatrix3x2fv(at("sh"), false, scene.sh_limit.flatMap((limit, i) => [limit, scene.sh_beyond[i]]));
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    // camera: {rotation (9, rows), translation, eye, intrinsics}, or null for that of the last call
    draw(camera, background) {
        const gl = this.gl, {program, at} = this.drawing, {width, height} = gl.canvas;
        if (gl.isContextLost()) return;  // it has no textures, and draws again when it is restored
        if (camera) this.project(camera);
        const frame = this.target(width, height);
        gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
        gl.viewport(0, 0, width, height);
        gl.clearColor(...(this.showing ? background.map(linear) : background), 1);
        gl.clear(gl.COLOR_BUFFER_BIT);
        gl.useProgram(program);
        [this.order, ...this.projected].forEach((texture, i) => {
            gl.activeTexture(gl.TEXTURE0 + i);
            gl.bindTexture(gl.TEXTURE_2D, texture);
            gl.uniform1i(at(["order", "firsts", "seconds"][i]), i);
        });
        gl.activeTexture(gl.TEXTURE0);
        gl.uniform1i(at("shown"), this.shown);
        gl.uniform2f(at("size"), width, height);
        gl.uniform1f(at("reach"), this.reach);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        const instances = Math.ceil(this.shown / QUADS);
        if (instances > 0) gl.drawElementsInstanced(gl.TRIANGLES, 6 * QUADS, gl.UNSIGNED_SHORT, 0, instances);
        if (!frame) return;
        if (this.showing) {
            gl.bindFramebuffer(gl.FRAMEBUFFER, null);
            gl.disable(gl.BLEND);
            gl.useProgram(this.showing.program);
            gl.bindTexture(gl.TEXTURE_2D, this.pixels);
            gl.uniform1i(this.showing.at("frame"), 0);
            gl.drawArrays(gl.TRIANGLES, 0, 3);
            return;
        }
        gl.bindFramebuffer(gl.READ_FRAMEBUFFER, frame);
        gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
        gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    }
}
