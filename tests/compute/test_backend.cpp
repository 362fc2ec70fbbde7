#include "compute/backends.hpp"

#include <random>

using namespace hexopt;
using namespace hexopt::compute;
using hexopt::compute::testing::ValidatedVulkan;

namespace {

std::vector<double> random_reals(std::size_t count, unsigned seed) {
    std::mt19937_64 generator(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<double> values(count);
    for (double& value : values) value = uniform(generator);
    return values;
}

// Sum of squares by dot_blocks and reduce_sum, everything in one recording.
Result<double> sum_of_squares(Backend& backend, const std::vector<double>& coordinates) {
    const auto count = static_cast<std::uint32_t>(coordinates.size() / 3);
    auto a = create_array<double>(backend, coordinates, "a");
    if (!a) return a.error();
    auto partial = backend.create_buffer((count / 512 + 1) * sizeof(double), "partial");
    if (!partial) return partial.error();
    auto sum = backend.create_buffer((count / 512 / 2048 + 2) * sizeof(double), "sum");
    if (!sum) return sum.error();
    Recorder recorder;
    const std::uint32_t blocks = (count + 511) / 512;
    recorder.dispatch(
        Precision::f64,
        args::dot_blocks{
            .a = a->ref(), .b = a->ref(), .target = partial->ref(), .entry_count = count, .count = blocks});
    const std::uint32_t groups = (blocks + 2047) / 2048;
    recorder.dispatch(Precision::f64, args::reduce_sum{.source = partial->ref(),
                                                       .target = sum->ref(8),
                                                       .entry_count = blocks,
                                                       .count = groups});
    recorder.dispatch(
        Precision::f64,
        args::reduce_sum{.source = sum->ref(8), .target = sum->ref(), .entry_count = groups, .count = 1});
    if (auto status = backend.submit(recorder); !status) return status.error();
    if (auto status = backend.wait(); !status) return status.error();
    auto result = read_array<double>(backend, *sum, 1);
    if (!result) return result.error();
    return result->front();
}

} // namespace

TEST_CASE("cpu: sum of squares in any order and with any number of threads is the same bits", "[cpu]") {
    const auto values = random_reals(3 * 300'001, 1);
    double expected = 0;
    for (double value : values) expected += value * value;
    const Parallel one(1), three(3);
    const double serial = sum_of_squares(*create_cpu_backend(one, CpuOrder::serial), values).value();
    CHECK(serial == Approx(expected).epsilon(1e-13));
    CHECK(sum_of_squares(*create_cpu_backend(three, CpuOrder::parallel), values).value() == serial);
    CHECK(sum_of_squares(*create_cpu_backend(three, CpuOrder::scalar), values).value() == serial);
    CHECK(sum_of_squares(*create_cpu_backend(one, CpuOrder::shuffled), values).value() == serial);
}

TEST_CASE("vulkan: sum of squares is the host's, bit for bit, also through staging", "[gpu]") {
    const auto values = random_reals(3 * 300'001, 1);
    const Parallel one(1);
    const double serial = sum_of_squares(*create_cpu_backend(one, CpuOrder::serial), values).value();
    for (bool staging : {false, true}) {
        VulkanOptions options;
        options.force_staging = staging;
        const ValidatedVulkan vulkan(options);
        if (!vulkan) return;
        CHECK(sum_of_squares(*vulkan, values).value() == serial);
    }
}
