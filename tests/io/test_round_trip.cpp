#include "io/mesh_io.hpp"
#include "io/sample_meshes.hpp"
#include "io/scratch.hpp"

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

struct Way {
    const char* name;
    MeshFormat format;
    Encoding encoding;
};

constexpr Way kArrayWays[] = {{"a.vtu", MeshFormat::vtu, Encoding::binary},
                              {"b.vtk", MeshFormat::vtk, Encoding::binary},
                              {"c.vtk", MeshFormat::vtk, Encoding::text}};

/// Reads a file under a name that says nothing about its format.
MeshFile read_back(const fs::path& path, const Context&) {
    Context context(1);
    std::string warnings;
    context.set_log_sink([&](LogLevel level, std::string_view text) {
        if (level >= LogLevel::warning) warnings += text;
    });
    const fs::path anonymous = path.parent_path() / "anonymous";
    fs::copy_file(path, anonymous, fs::copy_options::overwrite_existing);
    Result<MeshFile> file = read_mesh_file(anonymous, context);
    INFO((file ? "" : file.error().one_line()));
    REQUIRE(file);
    CHECK(warnings.empty());
    return std::move(*file);
}

} // namespace

TEST_CASE("meshes with arrays, levels and patches come back bit for bit") {
    const test::Scratch scratch;
    Context context(2);
    for (int size : {1, 3, 40}) {
        const MeshFile file = test::sample_block(size, 2, size);
        for (const Way& way : kArrayWays) {
            INFO(way.name << " " << size);
            const Status status = write_mesh(scratch / way.name, file.mesh, file.fields,
                                             {MeshFormat::from_name, way.encoding, 3}, context);
            INFO((status ? "" : status.error().one_line()));
            REQUIRE(status);
            const MeshFile back = read_back(scratch / way.name, context);
            test::check_same(file.mesh, back.mesh);
            test::check_same(file.fields, back.fields);
        }
    }
}

TEST_CASE("hanging constraints come back exactly") {
    const test::Scratch scratch;
    Context context(1);
    const HexMesh mesh = test::sample_hanging();
    for (const Way& way : kArrayWays) {
        INFO(way.name);
        REQUIRE(write_mesh(scratch / way.name, mesh, {}, {way.format, way.encoding, 9}, context));
        test::check_same(mesh, read_back(scratch / way.name, context).mesh);
    }
}

TEST_CASE("hanging vertices that a file does not name are recognised, unless asked not to") {
    const test::Scratch scratch;
    Context context(1);
    const HexMesh mesh = test::sample_hanging();
    REQUIRE(write_mesh(scratch / "a.mesh", mesh, {}, {}, context));
    const auto recognised = read_mesh(scratch / "a.mesh", context);
    REQUIRE(recognised);
    CHECK(recognised->hanging.vertex == mesh.hanging.vertex);
    CHECK(recognised->hanging.master == mesh.hanging.master);
    CHECK(recognised->hanging.weight == mesh.hanging.weight);
    const auto plain = read_mesh(scratch / "a.mesh", context, {false});
    REQUIRE(plain);
    CHECK(plain->hanging.empty());
}

TEST_CASE("MEDIT keeps positions, cells, references and patches") {
    const test::Scratch scratch;
    Context context(1);
    MeshFile file = test::sample_block(4, 3, 2);
    file.mesh.level.clear();
    REQUIRE(write_mesh(scratch / "a.mesh", file.mesh, file.fields, {}, context));
    const MeshFile back = read_back(scratch / "a.mesh", context);
    test::check_same(file.mesh, back.mesh);
    REQUIRE(back.fields.size() == 1);
    CHECK(back.fields[0].name == "medit:ref");
    CHECK(back.fields[0].values == file.fields[4].values);
}

TEST_CASE("the same mesh gives the same bytes for any number of threads") {
    const test::Scratch scratch;
    const MeshFile file = test::sample_block(30, 30, 30);
    std::string first;
    for (int threads : {1, 2, 5}) {
        Context context(threads);
        REQUIRE(write_mesh(scratch / "a.vtu", file.mesh, file.fields, {}, context));
        const std::string bytes = test::slurp(scratch / "a.vtu");
        if (first.empty()) first = bytes;
        CHECK(bytes == first);
    }
}

TEST_CASE("of two arrays with one name the later is written") {
    const test::Scratch scratch;
    Context context(1);
    MeshFile file = test::sample_block(1, 1, 1);
    file.fields = {{"q", FieldLocation::cell, 1, {1}},
                   {"q", FieldLocation::cell, 1, {2}},
                   {"level", FieldLocation::cell, 1, {3}}};
    REQUIRE(write_mesh(scratch / "a.vtu", file.mesh, file.fields, {}, context));
    const MeshFile back = read_back(scratch / "a.vtu", context);
    REQUIRE(back.fields.size() == 1);
    CHECK(back.fields[0].values == std::vector<double>{2});
    CHECK(back.mesh.level == file.mesh.level);
}

TEST_CASE("what cannot be written is refused and an earlier file kept") {
    const test::Scratch scratch;
    Context context(1);
    const MeshFile good = test::sample_block(1, 1, 1);
    REQUIRE(write_mesh(scratch / "a.vtu", good.mesh, good.fields, {}, context));
    const std::string before = test::slurp(scratch / "a.vtu");
    const auto refused = [&](const HexMesh& mesh, const std::vector<FieldData>& fields, ErrorCode code) {
        const Status status = write_mesh(scratch / "a.vtu", mesh, fields, {}, context);
        REQUIRE_FALSE(status);
        INFO(status.error().one_line());
        CHECK(status.error().code == code);
        CHECK(test::slurp(scratch / "a.vtu") == before);
        CHECK(scratch.entries() == 1);
    };
    MeshFile bad = good;
    bad.mesh.positions[3].y = std::nan("");
    refused(bad.mesh, {}, ErrorCode::output_failed);
    refused(good.mesh, {{"q", FieldLocation::cell, 1, {1, 2}}}, ErrorCode::output_failed);
    refused(good.mesh, {{"q", FieldLocation::cell, 1, {0.5}, FieldType::int32}}, ErrorCode::output_failed);
    refused(good.mesh, {{"q", FieldLocation::cell, 1, {256}, FieldType::uint8}}, ErrorCode::output_failed);
    refused(good.mesh, {{"hexopt_q", FieldLocation::cell, 1, {256}}}, ErrorCode::output_failed);
    CHECK(write_mesh(scratch / "a.obj", good.mesh, {}, {}, context).error().code == ErrorCode::usage);
    CHECK(write_mesh(scratch / "a.vtu", good.mesh, {}, {MeshFormat::vtu, Encoding::text, 3}, context)
              .error()
              .code == ErrorCode::usage);
    CHECK(write_mesh(scratch / "none" / "a.vtu", good.mesh, {}, {}, context).error().code ==
          ErrorCode::output_failed);
    CHECK(test::slurp(scratch / "a.vtu") == before);
}
