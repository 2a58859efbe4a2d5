// A camera that turns around a point. Rows of its rotation are its axes in the world: right, down, forward (OpenCV).

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const along = (a, b, t) => a.map((v, i) => v + t * b[i]);
const unit = a => a.map(v => v / Math.hypot(...a));

class OrbitCamera {
    // scene: {poses: [{size, intrinsics, world_to_camera (12 numbers, rows)}], up, center, radius}
    constructor(scene) {
        this.scene = scene;
        this.up = unit(scene.up);
        this.goTo(0);
    }

    goTo(number) {
        const pose = this.scene.poses[number], m = pose.world_to_camera;
        this.pose = pose;
        this.axes = [m.slice(0, 3), m.slice(4, 7), m.slice(8, 11)];
        const t = [m[3], m[7], m[11]];
        this.eye = [0, 1, 2].map(i => -(this.axes[0][i] * t[0] + this.axes[1][i] * t[1] + this.axes[2][i] * t[2]));
        const depth = dot(along(this.scene.center, this.eye, -1), this.axes[2]);
        this.distance = Math.max(depth, 0.1 * this.scene.radius, 1e-6);
        this.reach = Math.max(this.scene.radius, this.distance);
    }

    get pivot() { return along(this.eye, this.axes[2], this.distance); }

    rotate(axis, angle) {
        const pivot = this.pivot, c = Math.cos(angle), s = Math.sin(angle);
        this.axes = this.axes.map(v => {
            const w = cross(axis, v), d = dot(axis, v) * (1 - c);
            return v.map((x, i) => c * x + s * w[i] + d * axis[i]);
        });
        this.eye = along(pivot, this.axes[2], -this.distance);
    }

    // Radians to the right around `up`, and upwards, not over the poles.
    turn(right, upwards) {
        const elevation = Math.asin(Math.max(-1, Math.min(1, -dot(this.axes[2], this.up))));
        const most = 1.55, wanted = Math.max(-most, Math.min(most, elevation + upwards));
        if (upwards !== 0) this.rotate(this.axes[0], elevation - wanted);
        if (right !== 0) this.rotate(this.up, right);
    }

    // Parts of the image's smaller side.
    pan(right, down, width, height) {
        const f = this.intrinsics(width, height), step = this.distance * Math.min(width, height) / f[0];
        this.eye = along(along(this.eye, this.axes[0], -right * step), this.axes[1], -down * step);
    }

    zoom(factor) {
        const pivot = this.pivot;
        this.distance = Math.min(Math.max(this.distance * factor, 1e-3 * this.reach), 1e3 * this.reach);
        this.eye = along(pivot, this.axes[2], -this.distance);
    }

    // The pose's intrinsics, scaled so that all of its image is seen.
    intrinsics(width, height) {
        const [w, h] = this.pose.size, [fx, fy, cx, cy] = this.pose.intrinsics, s = Math.min(width / w, height / h);
        return [s * fx, s * fy, width / 2 + s * (cx - w / 2), height / 2 + s * (cy - h / 2)];
    }

    // For Painter.draw() and Sorter.sort().
    view(width, height) {
        return {rotation: this.axes.flat(), translation: this.axes.map(axis => -dot(axis, this.eye)), eye: this.eye,
                intrinsics: this.intrinsics(width, height)};
    }

    save() {
        return {number: this.scene.poses.indexOf(this.pose), axes: this.axes, eye: this.eye, distance: this.distance};
    }

    restore({number, ...place}) {
        this.goTo(number);
        Object.assign(this, place);
    }
}
