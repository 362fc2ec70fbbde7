#include "render/html_report.hpp"

#include "quality/report_json.hpp"
#include "render/html_chart.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <regex>

using namespace hexopt;
using nlohmann::json;

namespace {

json quality_of(double tangled) {
    Context context(2);
    SampleOptions options;
    options.tangled = tangled;
    const HexMesh mesh = *make_sample("grid", options, context);
    return to_json(*compute_quality(mesh, compute_topology(mesh), {}, context));
}

std::size_t count_of(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

/// Elements open and close in pairs, in the right order.
bool is_balanced(const std::string& html) {
    static const std::regex tag("<(/?)([a-z0-9]+)[^>]*?(/?)>", std::regex::icase);
    std::vector<std::string> open;
    for (std::sregex_iterator it(html.begin(), html.end(), tag), end; it != end; ++it) {
        const std::string name = (*it)[2];
        if (name == "meta" || name == "img" || (*it)[3] == "/") continue;
        if ((*it)[1].length() == 0) {
            open.push_back(name);
        } else {
            if (open.empty() || open.back() != name) return false;
            open.pop_back();
        }
    }
    return open.empty();
}

} // namespace

TEST_CASE("a page shows before and after, stages, notes and pictures") {
    const json report = {
        {"input", "a<b>&\"c\".vtk"},
        {"output", "out.vtu"},
        {"verdict", "ok"},
        {"quality_before", quality_of(0.1)},
        {"quality_after", quality_of(0)},
        {"stages", {{{"stage", "optimize"}, {"seconds", 1.25}, {"peak_memory_bytes", 1 << 20}}}},
        {"optimizer", {{"newton_steps", 12}, {"inner", {{"cells", {1, 2, 3}}}}}},
        {"deviation", nullptr},
        {"notes", {"<script>alert(1)</script>"}}};
    const std::string html = *make_html_report(report, {{"a picture", "Man"}, {"two", "Ma"}, {"three", "M"}});
    CHECK(is_balanced(html));
    CHECK(html.find("a&lt;b&gt;&amp;&quot;c&quot;.vtk &rarr; out.vtu") != std::string::npos);
    CHECK(html.find("<script") == std::string::npos);
    CHECK(html.find("Every cell is valid") != std::string::npos);
    CHECK(count_of(html, "<svg") == 3);
    CHECK(html.find("base64,TWFu\"") != std::string::npos);
    CHECK(html.find("base64,TWE=\"") != std::string::npos);
    CHECK(html.find("base64,TQ==\"") != std::string::npos);
    CHECK(html.find("newton steps</td><td>12<") != std::string::npos);
    CHECK(html.find("inner cells</td><td>1 2 3<") != std::string::npos);
    CHECK(html.find("1.250") != std::string::npos);
    // Nothing comes from elsewhere.
    CHECK(html.find("http") == std::string::npos);
    CHECK(html.find("url(") == std::string::npos);
}

TEST_CASE("a page of one mesh") {
    json report = quality_of(0.2);
    report["file"] = "mesh.vtu";
    const std::string html = *make_html_report(report, {});
    CHECK(is_balanced(html));
    CHECK(html.find("Not every cell is valid") != std::string::npos);
    CHECK(html.find(fmt::format(">{}<", report["validity"]["concave8"].get<int>())) != std::string::npos);
}

TEST_CASE("bars stand for the counts of the bins") {
    const std::string svg = histogram_svg("t", 0, 10, {{"n", "red", {0, 5, 0, 1, 0, 0}}});
    CHECK(is_balanced(svg));
    CHECK(svg.find("10 to 20, n: 5") != std::string::npos);
    CHECK(svg.find("30 to 40, n: 1") != std::string::npos);
    CHECK(count_of(svg, "<title>") == 2);
    CHECK(histogram_svg("t", 0, 1, {}).find("NaN") == std::string::npos);
}

TEST_CASE("reports with the wrong content are refused or drawn without it") {
    for (const json& bad : {json(nullptr), json(1), json::array(), json::object(), json("x"), json{{"a", 1}}})
        CHECK(make_html_report(bad, {}).error().code == ErrorCode::bad_input);
    json odd = quality_of(0);
    odd["scaled_jacobian"]["histogram"]["count"] = "many";
    odd["dihedral_deg"] = 7;
    odd["worst_cells"] = {1, "two", nullptr, {{"centre", "here"}}};
    odd["stages"] = {1, {{"seconds", "long"}}};
    odd["options"] = {{"a", {{"b", {{"c", {{"d", {{"e", {{"f", {{"g", 1}}}}}}}}}}}}}};
    odd["file"] = 3;
    odd["notes"] = {{{"x", 1}}};
    const Result<std::string> html = make_html_report(odd, {});
    REQUIRE(html);
    CHECK(is_balanced(*html));
    CHECK(make_html_report({{"quality_before", 1}, {"quality_after", nullptr}}, {}));
}
