#include "compute/backends.hpp"
#include "compute/device_choice.hpp"
#include "compute/host_application.hpp"
#include "compute/sample_problem.hpp"
#include "compute/vulkan/vulkan_api.hpp"
#include "stages/optimize/device_driver.hpp"

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

using namespace hexopt;
using namespace hexopt::compute;
using namespace hexopt::compute::testing;

namespace {

/// target = points + 0.5 step on `count` vertices, all f64.
struct StepRun {
    std::uint32_t count;
    std::vector<double> points, step;
    std::vector<std::uint32_t> vertex;

    explicit StepRun(std::uint32_t n) : count(n), points(3 * std::size_t{n}), step(points.size()), vertex(n) {
        for (std::size_t i = 0; i < points.size(); ++i) {
            points[i] = static_cast<double>(i);
            step[i] = static_cast<double>(i % 7);
        }
        for (std::uint32_t v = 0; v < n; ++v) vertex[v] = v;
    }

    struct Buffers {
        Buffer points, step, vertex, target;
    };

    Result<Buffers> upload(Backend& backend) const {
        auto p = create_array<double>(backend, points, "points");
        if (!p) return p.error();
        auto s = create_array<double>(backend, step, "step");
        if (!s) return s.error();
        auto v = create_array<std::uint32_t>(backend, vertex, "vertex");
        if (!v) return v.error();
        auto t = backend.create_buffer(points.size() * sizeof(double), "target");
        if (!t) return t.error();
        return Buffers{std::move(*p), std::move(*s), std::move(*v), std::move(*t)};
    }

    void record(Recorder& recorder, const Buffers& b) const {
        recorder.dispatch(Precision::f64, args::take_step{b.points.ref(), b.step.ref(), b.vertex.ref(),
                                                          b.target.ref(), 0.5f, count});
    }

    std::size_t wrong(const std::vector<double>& target) const {
        std::size_t bad = target.size() == points.size() ? 0 : 1;
        for (std::size_t i = 0; i < target.size(); ++i) bad += target[i] != points[i] + 0.5 * step[i];
        return bad;
    }
};

std::string cache_folder(const char* name) {
    const std::string folder = std::string(HEXOPT_BINARY_DIR "/") + name;
    std::filesystem::remove_all(folder);
    return folder;
}

std::filesystem::path only_file(const std::string& folder) {
    std::filesystem::path found;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        CHECK(found.empty());
        found = entry.path();
    }
    return found;
}

} // namespace

TEST_CASE("vulkan: arrays above 128 MiB work, at 6 million vertices", "[gpu][slow]") {
    const ValidatedVulkan vulkan;
    if (!vulkan) return;
    const StepRun run(6'000'000);
    REQUIRE(run.points.size() * sizeof(double) > (128u << 20));
    const auto buffers = run.upload(*vulkan);
    INFO((buffers ? "" : buffers.error().one_line()));
    REQUIRE(buffers);
    Recorder recorder;
    for (int repeat = 0; repeat < 4; ++repeat) run.record(recorder, *buffers);
    REQUIRE(vulkan->submit(recorder));
    const Status early = vulkan->wait(1e-6);
    REQUIRE_FALSE(early);
    CHECK(early.error().one_line().find("timed out") != std::string::npos);
    REQUIRE(vulkan->wait(600));
    CHECK(run.wrong(read_array<double>(*vulkan, buffers->target, run.points.size()).value()) == 0);
}

TEST_CASE("vulkan: a buffer beyond all memory is an error, and the device goes on", "[gpu]") {
    VulkanOptions options; // without the validation layer, which rightly warns of the size
    const auto created = create_vulkan_backend(options);
    if (!created) {
        std::cout << "SKIPPED: " << created.error().one_line() << std::endl;
        return;
    }
    VulkanBackend& vulkan = **created;
    const auto buffer = vulkan.create_buffer(std::size_t{1} << 50, "everything");
    REQUIRE_FALSE(buffer);
    CHECK(buffer.error().code == ErrorCode::out_of_memory);
    CHECK(buffer.error().where.find("everything") != std::string::npos);
    const StepRun run(1000);
    const auto buffers = run.upload(vulkan);
    REQUIRE(buffers);
    Recorder recorder;
    run.record(recorder, *buffers);
    REQUIRE(vulkan.submit(recorder));
    CHECK(run.wrong(read_array<double>(vulkan, buffers->target, run.points.size()).value()) == 0);
}

TEST_CASE("vulkan: buffers in memory that others had hold their own bytes", "[gpu]") {
    const ValidatedVulkan vulkan;
    if (!vulkan) return;
    std::vector<Buffer> kept;
    for (std::uint32_t round = 0; round < 3; ++round)
        for (std::size_t count : {1, 70, 1000, 1001, 300000}) {
            std::vector<std::uint32_t> values(count + round);
            for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint32_t>(i) + round;
            auto buffer = create_array<std::uint32_t>(*vulkan, values, "values");
            REQUIRE(buffer);
            CHECK(buffer->bytes() == 4 * values.size());
            auto freed = create_array<std::uint32_t>(*vulkan, values, "freed at once");
            REQUIRE(freed);
            if (round < 2) kept.push_back(std::move(*buffer));
            if (round == 1) kept.erase(kept.begin());
            const Buffer& last = round < 2 ? kept.back() : *buffer;
            CHECK(read_array<std::uint32_t>(*vulkan, last, values.size()).value() == values);
        }
}

TEST_CASE("vulkan: after the device is lost every call fails at once", "[gpu]") {
    VulkanOptions options;
    options.faults.device_lost = 0;
    const ValidatedVulkan vulkan(options);
    if (!vulkan) return;
    const StepRun run(100);
    auto buffers = run.upload(*vulkan);
    REQUIRE(buffers);
    Recorder recorder;
    run.record(recorder, *buffers);
    for (int repeat = 0; repeat < 2; ++repeat) {
        const Status status = vulkan->submit(recorder);
        REQUIRE_FALSE(status);
        CHECK(status.error().code == ErrorCode::device);
    }
    CHECK_FALSE(vulkan->wait());
    CHECK_FALSE(vulkan->create_buffer(4, "late"));
    std::vector<std::byte> data(8);
    CHECK_FALSE(vulkan->download(buffers->target, 0, data));
    CHECK_FALSE(vulkan->upload(buffers->target, 0, data));
}

TEST_CASE("vulkan: a damaged pipeline cache counts as none and is replaced", "[gpu]") {
    VulkanOptions options;
    options.cache_folder = cache_folder("damaged-cache");
    const StepRun run(100);
    const auto use = [&] {
        const ValidatedVulkan vulkan(options);
        if (!vulkan) return false;
        const auto buffers = run.upload(*vulkan);
        REQUIRE(buffers);
        Recorder recorder;
        run.record(recorder, *buffers);
        REQUIRE(vulkan->submit(recorder));
        CHECK(run.wrong(read_array<double>(*vulkan, buffers->target, run.points.size()).value()) == 0);
        return true;
    };
    if (!use()) return;
    const auto path = only_file(options.cache_folder);
    const auto read = [&] {
        std::ifstream file(path, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(file), {});
    };
    const std::string good = read();
    REQUIRE(good.size() > 24);
    std::string flipped = good;
    flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 1);
    for (const std::string& bad :
         {std::string("x"), good.substr(0, good.size() / 2), flipped, std::string(1 << 16, '\xff')}) {
        std::ofstream(path, std::ios::binary) << bad;
        REQUIRE(use());
        CHECK(read() != bad);
    }
}

TEST_CASE("vulkan: two contexts in two threads give the bits of one", "[gpu]") {
    const SampleProblem sample(bent_cube(3, 1.0, 3));
    std::atomic<bool> has_device{true};
    std::vector<std::vector<Point>> results(3);
    const auto work = [&](std::vector<Point>& positions) {
        VulkanOptions options;
        options.cache_folder = HEXOPT_BINARY_DIR "/pipeline-cache";
        const auto vulkan = create_vulkan_backend(options);
        if (!vulkan) {
            has_device = false;
            return;
        }
        Context context(1);
        const OptimizeOptions optimize_options;
        Budget budget(optimize_options, context);
        OptimizeStats stats;
        positions = sample.mesh.positions;
        const DeviceTarget target{vulkan->get()};
        if (!optimize_on_device(
                sample.mesh, sample.topology, nullptr, optimize_options, target, positions, budget, [] {},
                stats) ||
            !stats.notes.empty())
            positions.clear();
    };
    work(results[0]);
    if (!has_device) {
        std::cout << "SKIPPED: no Vulkan device" << std::endl;
        return;
    }
    std::thread other([&] { work(results[1]); });
    work(results[2]);
    other.join();
    REQUIRE_FALSE(results[0].empty());
    CHECK(results[1] == results[0]);
    CHECK(results[2] == results[0]);
}

TEST_CASE("vulkan: without a driver the default is the host, with the reason", "[gpu]") {
    const char* before = std::getenv("VK_ICD_FILENAMES");
    const std::string saved = before ? before : "";
    setenv("VK_ICD_FILENAMES", "/nonexistent.json", 1);
    setenv("VK_DRIVER_FILES", "/nonexistent.json", 1);
    const auto opened = open_device("auto", Precision::f64);
    const auto wanted = open_device("vulkan", Precision::f64);
    unsetenv("VK_DRIVER_FILES");
    if (before)
        setenv("VK_ICD_FILENAMES", saved.c_str(), 1);
    else
        unsetenv("VK_ICD_FILENAMES");
    REQUIRE(opened);
    CHECK(opened->choice.use_host);
    CHECK(opened->backend == nullptr);
    CHECK(opened->choice.reason.starts_with("cpu: "));
    REQUIRE_FALSE(wanted);
    CHECK(wanted.error().code == ErrorCode::device);
}

namespace {} // namespace

TEST_CASE("vulkan: works in a host application's device, queue and buffer, and leaves them alone", "[gpu]") {
    const StepRun run(5000);
    HostApplication host;
    if (!host.open(run.points.size() * sizeof(double))) {
        std::cout << "SKIPPED: no Vulkan device" << std::endl;
        return;
    }
    int locked = 0, locks = 0;
    for (int turn = 0; turn < 2; ++turn) {
        VulkanOptions options;
        options.external.get_instance_proc_addr = reinterpret_cast<void*>(host.get);
        options.external.instance = host.instance;
        options.external.physical_device = host.physical;
        options.external.device = host.device;
        options.external.queue = host.queue;
        options.external.f64 = true;
        options.external.lock = [&] { ++locked, ++locks; };
        options.external.unlock = [&] { --locked; };
        auto created = create_vulkan_backend(options);
        INFO((created ? "" : created.error().one_line()));
        REQUIRE(created);
        VulkanBackend& vulkan = **created;
        auto buffers = run.upload(vulkan);
        REQUIRE(buffers);
        auto imported = vulkan.import_buffer(host.buffer, run.points.size() * sizeof(double));
        REQUIRE(imported);
        buffers->target = std::move(*imported);
        Recorder recorder;
        run.record(recorder, *buffers);
        REQUIRE(vulkan.submit(recorder));
        CHECK(run.wrong(read_array<double>(vulkan, buffers->target, run.points.size()).value()) == 0);
    }
    CHECK(locked == 0);
    CHECK(locks >= 4); // the imported buffer is read through staging
}
