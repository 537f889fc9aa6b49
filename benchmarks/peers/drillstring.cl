// The right-hand side for clODE: states in units of their sizes, since it takes one scalar tolerance.
// Parameters: the constants of benchmarks/workload.py in their order, then the eight sizes.

#define TWO_OVER_PI 0.63661977236758134308

static inline realtype coefficient(realtype speed, realtype smoothing, realtype decay, realtype rise, realtype dynamic_) {
    return TWO_OVER_PI * atan(smoothing * speed) * (rise / (1.0 + decay * fabs(speed)) + dynamic_);
}

void getRHS(const realtype t, const realtype y_[], const realtype k[], realtype d_[], realtype aux_[],
            const realtype w_[]) {
    const realtype x = y_[0] * k[29], vx = y_[1] * k[30], y = y_[2] * k[31], vy = y_[3] * k[32];
    const realtype z = y_[4] * k[33], vz = y_[5] * k[34], twist = y_[6] * k[35], omega = y_[7] * k[36];
    const realtype phi = twist + k[0] + k[1] * t;
    realtype c;
    const realtype s = sincos(phi, &c);
    const realtype depth = k[23] * s * (4.0 * c * c - 1.0) - z;
    const realtype r = sqrt(x * x + y * y);
    const realtype drag = k[10] * sqrt(vx * vx + vy * vy);
    realtype force = 0.0, torque = 0.0, radial = 0.0, tangential = 0.0, friction = 0.0;
    if (depth > 0.0) {
        force = k[22] * depth;
        torque = force * coefficient(omega, k[24], k[25], k[26], k[27]);
    }
    if (r > k[15]) {
        const realtype per_r = 1.0 / r;
        const realtype normal = k[16] * (r - k[15]);
        const realtype slip = omega * k[17] + (x * vy - y * vx) * per_r;
        friction = normal * coefficient(slip, k[18], k[19], k[20], k[21]);
        radial = normal * per_r;
        tangential = friction * per_r;
    }
    radial += k[7] - k[8] * force - k[9] * torque;
    const realtype fx = tangential * y - radial * x - drag * vx;
    const realtype fy = -tangential * x - radial * y - drag * vy;
    const realtype moment = k[13] * omega + k[14] * twist + friction * k[17] + torque;
    const realtype alpha = -(moment + k[6] * (fy * c - fx * s)) * k[4];
    d_[0] = vx / k[29];
    d_[1] = (k[6] * (omega * omega * c + alpha * s) + fx * k[3]) / k[30];
    d_[2] = vy / k[31];
    d_[3] = (k[6] * (omega * omega * s - alpha * c) + fy * k[3]) / k[32];
    d_[4] = vz / k[33];
    d_[5] = (force - k[2] - k[11] * vz - k[12] * z) * k[5] / k[34];
    d_[6] = (omega - k[1]) / k[35];
    d_[7] = alpha / k[36];
}
