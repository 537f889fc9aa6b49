// The drill string through Boost.Odeint: a batch of independent runs, one after the other on one core.
//
// usage: odeint INPUT OUTPUT
// INPUT  doubles: runs, duration, rtol, then for each run 29 constants (benchmarks/workload.py: CONSTANTS), 8 sizes,
//        first step, 8 initial values.
// OUTPUT doubles: for each run 8 end values, evaluations, accepted steps.
// Prints: wall seconds, processor seconds, evaluations, accepted steps.
//
// -DSKIP=1 leaves out by a branch what is zero without contact: the bit torque off the rock, the wall off the wall.

#include <array>
#include <boost/numeric/odeint.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <vector>

#ifndef SKIP
#define SKIP 0
#endif

namespace odeint = boost::numeric::odeint;
using State = std::array<double, 8>;
constexpr double kTwoOverPi = 0.63661977236758134308;

struct Constants {
    double phase, drive, wob, per_m_l, per_J, per_m_a, q, k_bend, soft_F, soft_T, c_h, c_a, k_a, c_t, k_t, gap, k_w, R_c,
        eps_w, tau_w, rise_w, mu_w, k_c, s0, eps_b, tau_b, rise_b, mu_b, lobes;
};
struct Run {
    Constants constants;
    State sizes;
    double first_step;
    State initial;
};
static_assert(sizeof(Run) == 46 * sizeof(double), "the layout of the input");

struct DrillString {
    Constants k;
    int lobes;
    long evaluations = 0;

    explicit DrillString(const Constants& constants) : k(constants), lobes(static_cast<int>(constants.lobes)) {}

    static double coefficient(double speed, double smoothing, double decay, double rise, double dynamic) {
        return kTwoOverPi * std::atan(smoothing * speed) * (rise / (1.0 + decay * std::fabs(speed)) + dynamic);
    }

    void operator()(const State& y, State& d, double t) {
        ++evaluations;
        const double phi = y[6] + k.phase + k.drive * t, omega = y[7];
        const double s = std::sin(phi), c = std::cos(phi);  // one sincos call
        const double lobe = lobes == 3 ? s * (4.0 * c * c - 1.0) : lobes == 1 ? s : std::sin(lobes * phi);
        const double depth = k.s0 * lobe - y[4];
        const double r = std::sqrt(y[0] * y[0] + y[2] * y[2]);
        const double drag = k.c_h * std::sqrt(y[1] * y[1] + y[3] * y[3]);
        double force = 0.0, torque = 0.0, radial = 0.0, tangential = 0.0, friction = 0.0;
        if (!SKIP || depth > 0.0) {
            force = k.k_c * std::fmax(depth, 0.0);
            torque = force * coefficient(omega, k.eps_b, k.tau_b, k.rise_b, k.mu_b);
        }
        if (!SKIP || r > k.gap) {
            const double per_r = 1.0 / std::fmax(r, 1e-30);
            const double normal = k.k_w * std::fmax(r - k.gap, 0.0);
            const double slip = omega * k.R_c + (y[0] * y[3] - y[2] * y[1]) * per_r;
            friction = normal * coefficient(slip, k.eps_w, k.tau_w, k.rise_w, k.mu_w);
            radial = normal * per_r;
            tangential = friction * per_r;
        }
        radial += k.k_bend - k.soft_F * force - k.soft_T * torque;
        const double fx = tangential * y[2] - radial * y[0] - drag * y[1];
        const double fy = -tangential * y[0] - radial * y[2] - drag * y[3];
        const double moment = k.c_t * omega + k.k_t * y[6] + friction * k.R_c + torque;
        const double alpha = -(moment + k.q * (fy * c - fx * s)) * k.per_J;
        d[0] = y[1];
        d[1] = k.q * (omega * omega * c + alpha * s) + fx * k.per_m_l;
        d[2] = y[3];
        d[3] = k.q * (omega * omega * s - alpha * c) + fy * k.per_m_l;
        d[4] = y[5];
        d[5] = (force - k.wob - k.c_a * y[5] - k.k_a * y[4]) * k.per_m_a;
        d[6] = omega - k.drive;
        d[7] = alpha;
    }
};

// The root mean square of the errors against rtol (size + |y|), each state with its own size. (Odeint shows the checker
// the state before the step only.)
struct VectorTolerance {
    using value_type = double;
    double rtol;
    State sizes;

    template <class Algebra, class Error>
    double error(Algebra&, const State& before, const State&, Error& error, double) const {
        double sum = 0.0;
        for (int i = 0; i < 8; ++i) {
            const double ratio = error[i] / (sizes[i] + std::fabs(before[i]));
            sum += ratio * ratio;
        }
        return std::sqrt(sum * 0.125) / rtol;
    }
};

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    std::FILE* file = std::fopen(argv[1], "rb");
    double head[3];
    if (!file || std::fread(head, sizeof(double), 3, file) != 3) return 3;
    std::vector<Run> runs(static_cast<std::size_t>(head[0]));
    if (std::fread(runs.data(), sizeof(Run), runs.size(), file) != runs.size()) return 3;
    std::fclose(file);

    using Stepper = odeint::runge_kutta_dopri5<State>;
    using Controlled = odeint::controlled_runge_kutta<Stepper, VectorTolerance>;
    std::vector<double> out;
    out.reserve(10 * runs.size());
    long evaluations = 0, steps = 0;
    const auto begun = std::chrono::steady_clock::now();
    const std::clock_t cpu = std::clock();
    for (const Run& run : runs) {
        DrillString system(run.constants);
        State y = run.initial;
        const long accepted = static_cast<long>(odeint::integrate_adaptive(
            Controlled(VectorTolerance{head[2], run.sizes}), std::ref(system), y, 0.0, head[1], run.first_step));
        out.insert(out.end(), y.begin(), y.end());
        out.push_back(static_cast<double>(system.evaluations));
        out.push_back(static_cast<double>(accepted));
        evaluations += system.evaluations;
        steps += accepted;
    }
    const double cpu_seconds = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    file = std::fopen(argv[2], "wb");
    if (!file || std::fwrite(out.data(), sizeof(double), out.size(), file) != out.size()) return 4;
    std::fclose(file);
    std::printf("%.9g %.9g %ld %ld\n", seconds, cpu_seconds, evaluations, steps);
    return 0;
}
