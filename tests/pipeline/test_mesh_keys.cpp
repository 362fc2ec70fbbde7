#include "io/scratch.hpp"
#include "pipeline/mesh_keys.hpp"
#include "pipeline/size_texts.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <set>

using namespace hexopt;

namespace {

Status read_text(const std::string& text, MeshJob& job) {
    const test::Scratch scratch;
    test::spill(scratch / "config.toml", text);
    Context context(1);
    return read_mesh_config(scratch / "config.toml", job, context);
}

std::string refusal(const std::string& text) {
    MeshJob job;
    const Status status = read_text(text, job);
    REQUIRE_FALSE(status);
    return status.error().one_line();
}

/// A value that differs from what a key has.
ConfigValue other_value(const MeshKey& key, const MeshJob& job) {
    const ConfigValue now = key.get(job);
    switch (key.kind) {
    case MeshKey::Kind::yes_no:
        return !std::get<bool>(now);
    case MeshKey::Kind::number:
        if (key.name == "refine.normal_angle" || key.name == "surface.cad_angle") return 20.0;
        if (key.name == "optimize.max_deviation" || key.name == "surface.cad_deflection") return 0.0625;
        if (key.name == "surface.weld" || key.name == "features.reach") return 0.0078125;
        return std::holds_alternative<double>(now) && std::get<double>(now) == 0.5 ? 0.25 : 0.5;
    case MeshKey::Kind::whole:
        return key.name == "optimize.iterations" ? 7.0 : std::get<double>(now) + 1;
    case MeshKey::Kind::word:
        return key.type == "FILE" ? std::string("a \"file\".vtu") : key.type.substr(key.type.rfind('|') + 1);
    case MeshKey::Kind::numbers:
        break;
    case MeshKey::Kind::texts:
        if (key.name == "refine.curves") return std::vector<std::string>{"wing * size=0.25", "a b level=3"};
        return std::vector<std::string>{"box 0,0,0,1,2,3 size=0.5", "sphere 1,2,3,4.5 level=2 within=0.5",
                                        "cylinder 0,0,0,0,0,1,0.25 size=1", "patch * level=4 within=2"};
    }
    return key.name == "refine.initial_cells" || key.name == "trim.seeds"
               ? std::vector<double>{3, 4, 5}
               : std::vector<double>{0, 0, 0, 1, 2, 3};
}

} // namespace

TEST_CASE("keys: names and flags are different, and each changes what it says") {
    std::set<std::string> names, flags;
    for (const MeshKey& key : mesh_keys()) {
        INFO(key.name);
        CHECK(names.insert(key.name).second);
        CHECK(flags.insert(key.flag).second);
        CHECK(key.flag.starts_with("--"));
        MeshJob job;
        const ConfigValue before = key.get(job);
        const ConfigValue value = other_value(key, job);
        const Status set = set_mesh_key(job, key.name, value, "test");
        INFO((set ? "" : set.error().one_line()));
        REQUIRE(set);
        CHECK(key.get(job) == value);
        CHECK_FALSE(key.get(job) == before);
        // Nothing else has changed.
        std::size_t changed = 0;
        for (const MeshKey& other : mesh_keys()) changed += !(other.get(job) == other.get(MeshJob{}));
        CHECK(changed == 1);
    }
}

TEST_CASE("configuration: what is dumped is read back") {
    MeshJob job;
    for (const MeshKey& key : mesh_keys())
        if (key.name != "refine.max_cells")
            REQUIRE(set_mesh_key(job, key.name, other_value(key, job), "test"));
    REQUIRE(set_mesh_key(job, "patches.inlet \"a\".b.size", 0.125, "test"));
    REQUIRE(set_mesh_key(job, "patches.wall.level", 4.0, "test"));
    MeshJob back;
    const Status read = read_text(dump_mesh_config(job), back);
    INFO((read ? "" : read.error().one_line()));
    REQUIRE(read);
    for (const MeshKey& key : mesh_keys()) {
        INFO(key.name);
        CHECK(key.get(back) == key.get(job));
    }
    REQUIRE(back.options.refine.patches.size() == 2);
    CHECK(back.options.refine.patches[0].patch == "inlet \"a\".b");
    CHECK(back.options.refine.patches[0].target.size == 0.125);
    CHECK(back.options.refine.patches[1].target.level == 4);

    MeshJob standard;
    REQUIRE(read_text(dump_mesh_config(MeshJob{}), standard));
    for (const MeshKey& key : mesh_keys()) CHECK(key.get(standard) == key.get(MeshJob{}));
}

TEST_CASE("configuration: unknown keys are refused with the nearest known one and their line") {
    const std::string misspelt = refusal("[refine]\nsize = 1\nmax_cels = 100\n");
    CHECK(misspelt.find("refine.max_cells") != std::string::npos);
    CHECK(misspelt.find("config.toml:3") != std::string::npos);
    CHECK(refusal("collars = true\n").find("buffer.collars") != std::string::npos);
    CHECK(refusal("[patches.wall]\nsiz = 1\n").find("size and level") != std::string::npos);
}

TEST_CASE("configuration: wrong kinds, ranges and syntax are refused") {
    for (const char* text :
         {"[refine]\nsize = \"small\"\n", "[refine]\nsize = -1\n", "[refine]\nrings = 1.5\n",
          "[buffer]\nenabled = 1\n", "[buffer]\nmethod = \"magic\"\n", "[farfield]\nbox = [0, 0, 0, 1, 1]\n",
          "[farfield]\nbox = [0, 0, 0, 1, 1, 0]\n", "[trim]\nseeds = [[0, 0], [1, 1]]\n",
          "[trim]\nseeds = [\"a\"]\n", "[refine]\ninitial_cells = [1, 2.5, 3]\n",
          "[patches.wall]\nsize = 0\n", "[refine]\nsize = 1979-05-27\n"}) {
        INFO(text);
        MeshJob job;
        const Status status = read_text(text, job);
        REQUIRE_FALSE(status);
        CHECK(status.error().code == ErrorCode::usage);
        CHECK(status.error().where.find("config.toml:2") != std::string::npos);
    }
    for (const char* text : {"[refine\nsize = 1\n", "size = \n", "\xff\xfe\n", "a = 1\na = 2\n"}) {
        INFO(text);
        MeshJob job;
        const Status status = read_text(text, job);
        REQUIRE_FALSE(status);
        CHECK(status.error().code == ErrorCode::bad_input);
    }
    MeshJob job;
    Context context(1);
    CHECK(read_mesh_config("no-such.toml", job, context).error().code == ErrorCode::bad_input);
}

TEST_CASE("configuration: regions and curves that cannot be understood are refused") {
    for (const char* text :
         {"cube 0,0,0 size=1", "sphere 0,0,0 size=1", "box 0,0,0,1,1,1", "sphere 0,0,0,1 size=0",
          "sphere 0,0,0,1 width=3", "sphere 0,0,x,1 size=1", "sphere", "inside a.stl", "near within=1 level",
          "box 0,0,0,1,1,1 size=1,1", "box 0,0,0,1,1,1 size=1,1,0", "box 0,0,0,1,1,1 size=1,1,1 level=2"}) {
        INFO(text);
        MeshJob job;
        CHECK_FALSE(set_mesh_key(job, "refine.regions", std::vector<std::string>{text}, "--region"));
        CHECK(job.options.refine.regions.empty());
    }
    for (const char* text : {"wing size=1", "a b", "a b within=1", "a b c size=1"}) {
        INFO(text);
        MeshJob job;
        CHECK_FALSE(set_mesh_key(job, "refine.curves", std::vector<std::string>{text}, "--curve"));
    }
}

TEST_CASE("configuration: regions are written as they are read") {
    const std::vector<std::string> texts = {"box 0,0,0,1,2,3 size=0.5",
                                            "sphere 0,1,2,3 level=4 within=0.5",
                                            "cylinder 0,0,0,0,0,1,2 size=1",
                                            "patch * size=2 within=3",
                                            "inside box.stl size=1 within=2",
                                            "near folder/wake.obj level=3",
                                            "box 0,0,0,1,2,3 size=1,1,0.25 within=1"};
    MeshJob job, again;
    REQUIRE(set_mesh_key(job, "refine.regions", texts, "--region"));
    REQUIRE(read_mesh_config_text(dump_mesh_config(job), "dump", again));
    std::vector<std::string> written;
    for (const RegionTarget& region : again.options.refine.regions) written.push_back(to_text(region));
    CHECK(written == texts);
    CHECK(again.options.refine.regions[4].shape == RegionShape::inside);
    CHECK(again.options.refine.regions[5].file == "folder/wake.obj");
}

TEST_CASE("configuration: seeds may be lists of points") {
    MeshJob job;
    REQUIRE(read_text("[trim]\nseeds = [[0, 0, 1], [2, 3, 4.5]]\n", job));
    CHECK(job.options.trim.seeds == std::vector<Point>{{0, 0, 1}, {2, 3, 4.5}});
}
