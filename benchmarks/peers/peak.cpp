// The most fused multiply-adds a core makes: independent chains of full vector registers, nothing else.
// Prints floating-point operations per nanosecond, the best of some rounds.

#include <chrono>
#include <cstdio>

typedef double Vector __attribute__((vector_size(64)));
constexpr int kChains = 16, kTurns = 2'000'000;

int main() {
    double best = 0.0;
    for (int round = 0; round < 9; ++round) {
        Vector sum[kChains];
        for (int i = 0; i < kChains; ++i) sum[i] = Vector{} + (1.0 + i);
        Vector factor = Vector{} + 0.999999, term = Vector{} + 1e-6;
        asm volatile("" : "+m"(factor), "+m"(term));
        const auto begun = std::chrono::steady_clock::now();
        for (int n = 0; n < kTurns; ++n) {
#pragma GCC unroll 16
            for (int i = 0; i < kChains; ++i) sum[i] = sum[i] * factor + term;
        }
        asm volatile("" : : "m"(sum));
        const double ns = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begun).count();
        const double rate = 2.0 * 8 * kChains * kTurns / ns;
        best = rate > best ? rate : best;
    }
    std::printf("%.3f\n", best);
    return 0;
}
