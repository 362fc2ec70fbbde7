#include "io/readers.hpp"
#include "io/sample_meshes.hpp"
#include "io/scratch.hpp"
#include "io/surface_readers.hpp"
#include "io/surface_samples.hpp"

#include <array>
#include <atomic>
#include <cstdlib>
#include <functional>
#include <malloc.h>
#include <new>

using namespace hexopt;
namespace fs = std::filesystem;

// Sanitizers bring their own allocator, and limits.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCountsMemory = false;
#else
constexpr bool kCountsMemory = true;
#endif

namespace {

std::atomic<std::size_t> live_bytes{0}, peak_bytes{0};

} // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
void* operator new(std::size_t size) {
    void* block = std::malloc(size > 0 ? size : 1);
    if (block == nullptr) throw std::bad_alloc();
    const std::size_t live = live_bytes += malloc_usable_size(block);
    std::size_t peak = peak_bytes;
    while (peak < live && !peak_bytes.compare_exchange_weak(peak, live)) {
    }
    return block;
}
void operator delete(void* block) noexcept {
    if (block != nullptr) live_bytes -= malloc_usable_size(block);
    std::free(block);
}
void operator delete(void* block, std::size_t) noexcept { operator delete(block); }
#endif

namespace {

struct Sample {
    std::string name, bytes;
};

std::vector<Sample> mesh_samples() {
    std::vector<Sample> samples;
    const test::Scratch scratch;
    Context context(1);
    MeshFile block = test::sample_block(2, 1, 2);
    const HexMesh hanging = test::sample_hanging();
    for (const auto& [name, encoding] : {std::pair{"a.vtu", Encoding::binary},
                                         {"a.vtk", Encoding::binary},
                                         {"b.vtk", Encoding::text},
                                         {"a.mesh", Encoding::text}}) {
        REQUIRE(write_mesh(scratch / name, block.mesh, block.fields, {MeshFormat::from_name, encoding, 3},
                           context));
        samples.push_back({std::string("own block ") + name, test::slurp(scratch / name)});
        REQUIRE(write_mesh(scratch / name, hanging, {}, {MeshFormat::from_name, encoding, 3}, context));
        samples.push_back({std::string("own hanging ") + name, test::slurp(scratch / name)});
    }
    std::vector<fs::path> paths;
    for (const auto& entry : fs::directory_iterator(HEXOPT_IO_DATA))
        if (entry.path().extension() != ".md" && entry.path().extension() != ".geo")
            paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    for (const fs::path& path : paths) samples.push_back({path.filename().string(), test::slurp(path)});
    return samples;
}

std::vector<Sample> surface_samples() {
    std::string binary(84, '\0');
    binary[80] = 3;
    std::mt19937_64 random(3);
    for (int t = 0; t < 3; ++t) {
        for (int i = 0; i < 12; ++i) {
            const float value = static_cast<float>(random() % 100);
            binary.append(reinterpret_cast<const char*>(&value), 4);
        }
        binary.append(2, '\0');
    }
    std::string ply = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float "
                      "y\nproperty float z\n"
                      "element face 1\nproperty list uchar int vertex_index\nend_header\n";
    ply.append(36, '\0');
    ply += std::string("\x03\0\0\0\0\0\0\0\1\0\0\0\2", 13);
    return {{"a.stl", test::kAsciiStl}, {"b.stl", binary}, {"a.obj", test::kObj}, {"a.off", test::kOff},
            {"a.ply", test::kPly},      {"b.ply", ply},    {"a.vtp", test::kVtp}};
}

std::string with_number_replaced(const std::string& bytes, std::mt19937_64& random) {
    static const std::array<std::string, 8> kNumbers = {"4294967295", "99999999999999999999", "-1",
                                                        "0",          "1000000007",           "nan",
                                                        "2147483648", "9223372036854775807"};
    const std::size_t start = random() % bytes.size();
    const std::size_t begin = bytes.find_first_of("0123456789", start);
    if (begin == std::string::npos) return bytes;
    const std::size_t end = std::min(bytes.find_first_not_of("0123456789", begin), bytes.size());
    return bytes.substr(0, begin) + kNumbers[random() % kNumbers.size()] + bytes.substr(end);
}

std::string with_binary_number(std::string bytes, std::mt19937_64& random) {
    static const std::array<std::uint64_t, 6> kNumbers = {~0ull,      0,          0x7FFFFFFF,
                                                          0x80000000, 1ull << 40, 0x7FFFFFFFFFFFFFFF};
    const std::uint64_t number = kNumbers[random() % kNumbers.size()];
    const std::size_t width = random() % 2 == 0 ? 4 : 8, at = random() % bytes.size();
    for (std::size_t i = 0; i < width && at + i < bytes.size(); ++i)
        bytes[at + i] = static_cast<char>(number >> (8 * (random() % 2 == 0 ? i : width - 1 - i)));
    return bytes;
}

std::string with_random_edits(std::string bytes, std::mt19937_64& random) {
    for (std::uint64_t edit = 0, edits = 1 + random() % 6; edit < edits && !bytes.empty(); ++edit) {
        const std::size_t at = random() % bytes.size(), size = 1 + random() % 20;
        switch (random() % 4) {
        case 0:
            bytes[at] = static_cast<char>(random());
            break;
        case 1:
            bytes.erase(at, size);
            break;
        case 2:
            bytes.insert(at, bytes.substr(random() % bytes.size(), size));
            break;
        default:
            bytes[at] ^= static_cast<char>(1u << (random() % 8));
        }
    }
    return bytes;
}

/// Calls read(bytes, is_truncation) with a few hundred damaged forms of each sample.
std::size_t for_each_damage(const std::vector<Sample>& samples,
                            const std::function<void(const Sample&, const std::string&, bool)>& read) {
    constexpr int kRounds = 400;
    std::mt19937_64 random(20261122);
    std::size_t cases = 0;
    for (const Sample& sample : samples) {
        for (std::size_t part = 0; part < 64; ++part, ++cases)
            read(sample, sample.bytes.substr(0, sample.bytes.size() * part / 64), true);
        for (int round = 0; round < kRounds; ++round, cases += 3) {
            read(sample, with_number_replaced(sample.bytes, random), false);
            read(sample, with_binary_number(sample.bytes, random), false);
            read(sample, with_random_edits(sample.bytes, random), false);
        }
    }
    return cases;
}

bool is_sound(const MeshFile& file) {
    const HexMesh& mesh = file.mesh;
    bool sound = mesh.cell_count() > 0 && (mesh.level.empty() || mesh.level.size() == mesh.cell_count());
    for (const Point& p : mesh.positions)
        sound = sound && std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    for (const Cell& cell : mesh.cells)
        for (Index v : cell) sound = sound && v < mesh.vertex_count();
    for (const BoundaryQuad& quad : mesh.boundary) {
        sound = sound && quad.patch < mesh.patch_names.size();
        for (Index v : quad.vertices) sound = sound && v < mesh.vertex_count();
    }
    sound = sound && mesh.hanging.offset.size() == mesh.hanging.vertex.size() + 1 &&
            mesh.hanging.offset.back() == mesh.hanging.master.size();
    for (Index v : mesh.hanging.vertex) sound = sound && v < mesh.vertex_count();
    for (Index v : mesh.hanging.master) sound = sound && v < mesh.vertex_count();
    for (const FieldData& field : file.fields)
        sound = sound && field.values.size() == field.components * (field.location == FieldLocation::point
                                                                        ? mesh.vertex_count()
                                                                        : mesh.cell_count());
    return sound;
}

bool is_sound(const Error& error) {
    return error.code == ErrorCode::bad_input && error.stage == "read" &&
           error.where.starts_with("damaged") && !error.reasons.empty();
}

/// Runs `read` and checks what it allocated at most.
template <class Read>
void with_bounded_memory(std::size_t file_bytes, std::size_t bytes_each, const Read& read) {
    constexpr std::size_t kBase = std::size_t{1} << 20;
    const std::size_t before = live_bytes;
    peak_bytes = before;
    read();
    if (kCountsMemory && peak_bytes - before > kBase + bytes_each * file_bytes)
        FAIL("allocated " << peak_bytes - before << " bytes for a file of " << file_bytes);
}

} // namespace

TEST_CASE("damaged meshes give an error or a sound mesh, within bounded memory") {
    const std::vector<Sample> samples = mesh_samples();
    REQUIRE(samples.size() >= 25);
    std::size_t accepted = 0;
    const std::size_t cases =
        for_each_damage(samples, [&](const Sample& sample, const std::string& bytes, bool is_truncation) {
            with_bounded_memory(bytes.size(), 1200, [&] {
                Context context(1);
                const auto file = io_detail::read_mesh_bytes("damaged", bytes, context, {});
                INFO(sample.name);
                if (!file) {
                    if (!is_sound(file.error())) FAIL(file.error().one_line());
                    return;
                }
                ++accepted;
                if (!is_sound(*file)) FAIL("a mesh that is not sound");
                if (!is_truncation) return;
                const auto whole = io_detail::read_mesh_bytes("damaged", sample.bytes, context, {});
                REQUIRE(whole);
                if (file->mesh.cells != whole->mesh.cells) FAIL("cells were lost in silence");
            });
        });
    CHECK(cases > 30000);
    CHECK(accepted < cases / 2);
}

TEST_CASE("damaged surfaces give an error or a sound surface, within bounded memory") {
    const std::size_t cases =
        for_each_damage(surface_samples(), [&](const Sample& sample, const std::string& bytes, bool) {
            with_bounded_memory(bytes.size(), 200, [&] {
                const Context context(1);
                const auto soup = io_detail::read_surface_bytes("damaged", bytes, context);
                INFO(sample.name);
                if (!soup) {
                    if (!is_sound(soup.error())) FAIL(soup.error().one_line());
                    return;
                }
                bool sound = soup->patch.size() == soup->triangles.size();
                for (const auto& triangle : soup->triangles)
                    for (Index v : triangle) sound = sound && v < soup->vertices.size();
                for (Index patch : soup->patch) sound = sound && patch < soup->patch_names.size();
                if (!sound) FAIL("a surface that is not sound");
            });
        });
    CHECK(cases > 6000);
}

TEST_CASE("what compresses beyond its format's limit is refused before it is unpacked") {
    const test::Scratch scratch;
    Context context(1);
    MeshFile block = test::sample_block(1, 1, 1);
    REQUIRE(write_mesh(scratch / "a.vtu", block.mesh, {}, {}, context));
    std::string bytes = test::slurp(scratch / "a.vtu");
    const auto replace = [&](const std::string& from, const std::string& to) {
        REQUIRE(bytes.find(from) != std::string::npos);
        bytes.replace(bytes.find(from), from.size(), to);
    };
    replace("NumberOfPoints=\"8\"", "NumberOfPoints=\"4000000000\"");
    with_bounded_memory(bytes.size(), 0, [&] {
        const auto file = io_detail::read_mesh_bytes("damaged", bytes, context, {});
        REQUIRE_FALSE(file);
        CHECK(file.error().one_line().find("where 96000000000 are needed") != std::string::npos);
    });
}
