#include "io/read_surface.hpp"
#include "io/scratch.hpp"
#include "io/surface_samples.hpp"
#include "support/skip.hpp"

#include <cstring>
#include <sstream>

using namespace hexopt;
using namespace hexopt::test;
namespace fs = std::filesystem;

namespace {

Result<TriangleSoup> read_text(const std::string& text, const char* name = "surface") {
    const test::Scratch scratch;
    test::spill(scratch / name, text);
    Context context(1);
    return read_surface(scratch / name, context);
}

template <class T>
void append(std::string& bytes, T value, bool big = false) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big) std::reverse(raw, raw + sizeof(T));
    bytes.append(raw, sizeof(T));
}

std::string binary_stl(const TriangleSoup& soup, std::uint32_t announced) {
    std::string bytes = "solid is no mark of an ASCII file";
    bytes.resize(80);
    append(bytes, announced);
    for (const auto& triangle : soup.triangles) {
        for (int k = 0; k < 3; ++k) append(bytes, 0.0f);
        for (Index v : triangle)
            for (int k = 0; k < 3; ++k) append(bytes, static_cast<float>(soup.vertices[v][k]));
        append(bytes, std::uint16_t{7});
    }
    return bytes;
}

void check_square(const Result<TriangleSoup>& soup) {
    INFO((soup ? "" : soup.error().one_line()));
    REQUIRE(soup);
    CHECK(soup->vertices == std::vector<Point>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    CHECK(soup->triangles == std::vector<std::array<Index, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 1, 3}});
    CHECK(soup->patch.size() == 3);
}

} // namespace

TEST_CASE("ASCII STL: solids are patches, equal vertices become one") {
    const auto soup = read_text(kAsciiStl);
    INFO((soup ? "" : soup.error().one_line()));
    REQUIRE(soup);
    CHECK(soup->vertices == std::vector<Point>{{0, 0, 0}, {0, 1.5, 0}, {1, 0, 0}, {0, 0, 2}, {1, 0, 2}});
    CHECK(soup->triangles == std::vector<std::array<Index, 3>>{{0, 1, 2}, {0, 2, 3}, {2, 4, 3}});
    CHECK(soup->patch == std::vector<Index>{0, 1, 1});
    CHECK(soup->patch_names == std::vector<std::string>{"bottom part", "side"});
}

TEST_CASE("binary STL gives what its ASCII form gives") {
    const auto text = read_text(kAsciiStl);
    REQUIRE(text);
    const auto binary = read_text(binary_stl(*text, 3));
    REQUIRE(binary);
    CHECK(binary->vertices == text->vertices);
    CHECK(binary->triangles == text->triangles);
}

TEST_CASE("OBJ, OFF and PLY are read") {
    const auto obj = read_text(kObj);
    check_square(obj);
    CHECK(obj->patch == std::vector<Index>{0, 0, 1});
    CHECK(obj->patch_names == std::vector<std::string>{"first group", "second"});
    const auto materials =
        read_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 2\nusemtl a\nf 2 1 3\n");
    REQUIRE(materials);
    CHECK(materials->patch == std::vector<Index>{0, 1, 0});
    CHECK(materials->patch_names == std::vector<std::string>{"a", "b"});
    check_square(read_text(kOff));
    check_square(read_text(kPly));
}

TEST_CASE("binary PLY is read in both byte orders") {
    for (bool big : {false, true}) {
        std::string bytes = kPly.substr(0, kPly.find("end_header")) + "end_header\n";
        bytes.replace(bytes.find("ascii"), 5, big ? "binary_big_endian" : "binary_little_endian");
        const float corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        for (const auto& corner : corners) {
            append(bytes, corner[0], big);
            append(bytes, corner[1], big);
            append(bytes, 0.0, big);
            bytes += '\xFF';
        }
        const std::vector<std::vector<int>> faces = {{0, 1, 2, 3}, {0, 1, 3}};
        for (const auto& face : faces) {
            bytes += static_cast<char>(face.size());
            for (int v : face) append(bytes, v, big);
            append(bytes, 0.5f, big);
        }
        append(bytes, std::int32_t{0}, big);
        append(bytes, std::int32_t{1}, big);
        check_square(read_text(bytes));
        CHECK_FALSE(read_text(bytes.substr(0, bytes.size() - 1)));
    }
}

TEST_CASE("surfaces that are wrong are refused with place and advice") {
    const auto soup = read_text(kAsciiStl);
    REQUIRE(soup);
    const auto refused = [](const std::string& text, const std::string& part) {
        const auto result = read_text(text);
        REQUIRE_FALSE(result);
        INFO(result.error().one_line());
        CHECK(result.error().code == ErrorCode::bad_input);
        CHECK(result.error().reasons.size() == 2);
        CHECK(result.error().one_line().find(part) != std::string::npos);
    };
    const auto with = [](std::string text, const std::string& from, const std::string& to) {
        return text.replace(text.find(from), from.size(), to);
    };
    refused(with(kAsciiStl, "vertex 0 1.5 0", "vertex 0 nan 0"), "surface:5: ");
    refused(with(kAsciiStl, "endloop", "vertex 0 0 0\nendloop"), "surface:7: ");
    refused(kAsciiStl.substr(0, kAsciiStl.size() - 9), "before endsolid");
    refused(kAsciiStl.substr(0, 200), "surface:");
    refused("solid nothing\nendsolid\n", "no triangles");
    refused(with(kObj, "f -4//1", "f -5//1"), "surface:12: vertex id -5");
    refused(with(kObj, "f 1/1/1", "f 9/1/1"), "uses vertex 8 of 4");
    refused(with(kObj, "v 1 1 0", "v 1 inf 0"), "surface:5: ");
    refused(with(kOff, "4 2 0", "4 3 0"), "surface:");
    refused(with(kOff, "4 2 0", "4000000000 2 0"), "announces 4000000000");
    refused(with(kOff, "3 0 1 3", "3 0 1 4"), "uses vertex 4 of 4");
    refused(with(kPly, "vertex 4", "vertex 4294967295"), "announces 4294967295");
    refused(with(kPly, "3 0 1 3", "3 0 1 -3"), "vertex id -3");
    refused(with(kPly, "3 0 1 3", "4000000000 0 1 3"), "a list of 4");
    refused("no surface at all\n", "no surface format");
}

TEST_CASE("binary STL with a wrong count is refused or its rest named") {
    const auto soup = read_text(kAsciiStl);
    REQUIRE(soup);
    const auto name = "a.stl";
    for (std::uint32_t count : {4u, 0xFFFFFFFFu, 0x80000000u}) {
        const auto result = read_text(binary_stl(*soup, count).replace(0, 5, "xxxxx"), name);
        REQUIRE_FALSE(result);
        CHECK(result.error().one_line().find("announces " + std::to_string(count)) != std::string::npos);
    }
    const auto shorter = read_text(binary_stl(*soup, 2).replace(0, 5, "xxxxx"), name);
    REQUIRE(shorter);
    CHECK(shorter->triangles.size() == 2);
}

TEST_CASE("the real surfaces have the triangles and vertices of their manifest") {
    const fs::path folder = fs::path(HEXOPT_SHARED_DATA) / "geometry";
    if (!fs::exists(folder)) {
        HEXOPT_SKIP(folder.string() + " is absent");
    }
    std::istringstream manifest(test::slurp(folder / "manifest.csv"));
    std::string line;
    std::getline(manifest, line);
    int count = 0;
    while (std::getline(manifest, line)) {
        std::istringstream fields(line);
        std::vector<std::string> field(9);
        bool quoted = false;
        std::size_t number = 0;
        for (char c : line) {
            if (c == '"') quoted = !quoted;
            if (c == ',' && !quoted)
                ++number;
            else if (number < field.size())
                field[number] += c;
        }
        if (fs::path(field[1]).extension() != ".stl") continue;
        INFO(field[1]);
        Context context(1);
        const auto soup = read_surface(folder / field[1], context);
        INFO((soup ? "" : soup.error().one_line()));
        REQUIRE(soup);
        CHECK(soup->triangles.size() == std::stoul(field[7]));
        CHECK(soup->vertices.size() == std::stoul(field[8]));
        ++count;
    }
    CHECK(count == 64);
}

TEST_CASE("a build without OpenCASCADE says so of CAD files") {
    const Scratch scratch;
    spill(scratch / "empty.stp", "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n");
    Context context(1);
    const auto surface = read_surface(scratch / "empty.stp", context);
    REQUIRE(!surface);
    CHECK(surface.error().code == ErrorCode::bad_input);
    const bool says_so =
        surface.error().one_line().find("this build has no OpenCASCADE") != std::string::npos;
    CHECK(says_so != cad_is_supported());
}
