#include "render/html_report.hpp"

#include "render/html_chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

using nlohmann::json;

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; }
body { font: 15px/1.45 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin-bottom: .2rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .8rem .2rem 0; border-bottom: 1px solid #8884; text-align: right; }
th:first-child, td:first-child { text-align: left; }
.ok { color: #18794e; font-weight: 600; } .bad { color: #c2186b; font-weight: 600; }
.row { display: flex; flex-wrap: wrap; gap: 1rem; } .row > * { flex: 1 1 26rem; min-width: 0; margin: 0; }
img { width: 100%; background: #fff; border: 1px solid #8884; } figcaption { font-size: .9em; }
svg { width: 100%; font-size: 12px; } svg text { fill: currentColor; }
svg .title { font-weight: 600; } svg .tick { font-size: 10px; opacity: .75; }
svg .grid { stroke: currentColor; opacity: .15; } svg .axis { stroke: currentColor; opacity: .6; }
.bar { display: inline-block; height: .7em; background: #4d8fd6; }
)";

/// A part of the report by JSON pointer; null where it is missing.
const json& part_of(const json& report, const char* pointer) {
    static const json kNothing;
    const json::json_pointer path(pointer);
    return report.contains(path) ? report.at(path) : kNothing;
}

std::string text_of(const json& value) {
    if (value.is_string()) return escape_html(value.get<std::string>());
    if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
    if (value.is_number_integer()) return value.dump();
    if (value.is_number()) return fmt::format("{:.5g}", value.get<double>());
    return "&ndash;";
}

/// A mesh that the report measures.
struct Measured {
    std::string name, color;
    const json* quality;
};

std::vector<Measured> measured_meshes(const json& report) {
    const bool has_pair = report.contains("quality_before") || report.contains("quality_after");
    std::vector<Measured> meshes;
    if (has_pair) {
        if (report.contains("quality_before"))
            meshes.push_back({"before", "#e0902f", &report["quality_before"]});
        if (report.contains("quality_after"))
            meshes.push_back({"after", "#3f83cf", &report["quality_after"]});
    } else if (report.contains("scaled_jacobian")) {
        meshes.push_back({"mesh", "#3f83cf", &report});
    }
    return meshes;
}

std::string summary_html(const std::vector<Measured>& meshes) {
    static constexpr std::array<std::pair<const char*, const char*>, 22> kRows = {
        {{"cells", "/cells"},
         {"vertices", "/vertices"},
         {"hanging vertices", "/hanging_vertices"},
         {"every cell valid", "/validity/is_valid"},
         {"cells concave in the 8 corner tetrahedra", "/validity/concave8"},
         {"cells concave in the 24 path tetrahedra", "/validity/concave24"},
         {"trilinear map: certified valid", "/validity/jacobian_valid"},
         {"trilinear map: invalid", "/validity/jacobian_invalid"},
         {"trilinear map: undecided", "/validity/jacobian_undecided"},
         {"scaled Jacobian, minimum", "/scaled_jacobian/min"},
         {"scaled Jacobian, 1 %", "/scaled_jacobian/p1"},
         {"scaled Jacobian, 5 %", "/scaled_jacobian/p5"},
         {"scaled Jacobian, mean", "/scaled_jacobian/mean"},
         {"least dihedral angle, degrees", "/dihedral_deg/min_of_cell/min"},
         {"least dihedral angle, 1 %", "/dihedral_deg/min_of_cell/p1"},
         {"largest dihedral angle, degrees", "/dihedral_deg/max_of_cell/max"},
         {"aspect ratio, largest", "/aspect_ratio/max"},
         {"aspect ratio, 99 %", "/aspect_ratio/p99"},
         {"neighbour volume ratio, largest", "/neighbour_volume_ratio/max"},
         {"shortest edge", "/edge_length/min"},
         {"cells without positive volume", "/nonpositive_volumes"},
         {"total volume", "/total_volume"}}};
    std::string html = "<table><tr><th></th>";
    for (const Measured& mesh : meshes) html += fmt::format("<th>{}</th>", mesh.name);
    html += "</tr>\n";
    for (const auto& [label, pointer] : kRows) {
        html += fmt::format("<tr><td>{}</td>", label);
        for (const Measured& mesh : meshes)
            html += fmt::format("<td>{}</td>", text_of(part_of(*mesh.quality, pointer)));
        html += "</tr>\n";
    }
    return html + "</table>\n";
}

std::string histogram_html(const std::vector<Measured>& meshes, const char* title,
                           const std::string& pointer) {
    std::vector<ChartSeries> series;
    double low = 0, width = 1;
    for (const Measured& mesh : meshes) {
        const json& histogram = part_of(*mesh.quality, pointer.c_str());
        const json &counts = part_of(histogram, "/count"), &bin_low = part_of(histogram, "/low"),
                   &bin_width = part_of(histogram, "/width");
        if (!counts.is_array() || !bin_low.is_number() || !bin_width.is_number()) continue;
        low = bin_low.get<double>();
        width = bin_width.get<double>();
        ChartSeries& s = series.emplace_back(ChartSeries{mesh.name, mesh.color, {}});
        for (const json& count : counts) s.count.push_back(count.is_number() ? count.get<double>() : 0);
    }
    return series.empty() ? std::string() : histogram_svg(title, low, width, series);
}

std::string worst_html(const Measured& mesh) {
    const json& cells = part_of(*mesh.quality, "/worst_cells");
    if (!cells.is_array() || cells.empty()) return {};
    std::string html =
        "<div><p>" + mesh.name +
        "</p><table><tr><th>cell</th><th>scaled Jacobian</th><th>concave 8 + 24</th><th>map</th>"
        "<th>least angle</th><th>aspect</th><th>centre</th></tr>\n";
    for (const json& cell : cells) {
        std::string centre;
        const json& at = part_of(cell, "/centre");
        for (const json& x : at.is_array() ? at : json::array()) centre += text_of(x) + " ";
        html += fmt::format(
            "<tr><td>{}</td><td>{}</td><td>{} + {}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            text_of(part_of(cell, "/cell")), text_of(part_of(cell, "/scaled_jacobian")),
            text_of(part_of(cell, "/concave8_tets")), text_of(part_of(cell, "/concave24_tets")),
            text_of(part_of(cell, "/jacobian")), text_of(part_of(cell, "/min_dihedral")),
            text_of(part_of(cell, "/aspect_ratio")), centre);
    }
    return html + "</table></div>\n";
}

std::string stages_html(const json& stages) {
    if (!stages.is_array() || stages.empty()) return {};
    const auto seconds_of = [](const json& stage) {
        const json& seconds = part_of(stage, "/seconds");
        return seconds.is_number() ? seconds.get<double>() : 0.0;
    };
    double total = 0;
    for (const json& stage : stages) total += seconds_of(stage);
    std::string html =
        "<h2>Stages</h2>\n<table><tr><th>stage</th><th>seconds</th><th>peak memory, MiB</th><th></th></tr>\n";
    for (const json& stage : stages) {
        const json& memory = part_of(stage, "/peak_memory_bytes");
        const double share = total > 0 ? seconds_of(stage) / total : 0;
        html += fmt::format("<tr><td>{}</td><td>{:.3f}</td><td>{}</td><td style=\"text-align:left\">"
                            "<span class=\"bar\" style=\"width:{:.1f}rem\"></span></td></tr>\n",
                            text_of(part_of(stage, "/stage")), seconds_of(stage),
                            memory.is_number() && memory > 0
                                ? fmt::format("{:.0f}", memory.get<double>() / 1048576)
                                : std::string("&ndash;"),
                            15 * share);
    }
    return html + fmt::format("<tr><td>total</td><td>{:.3f}</td><td></td><td></td></tr></table>\n", total);
}

constexpr int kMaxDepth = 5; ///< of objects in objects; deeper ones are left out

/// Names and values of an object's plain members, those of objects within as "outer inner".
void append_rows(std::string& html, const json& object, const std::string& prefix, int depth) {
    for (const auto& [key, value] : object.items()) {
        std::string name = prefix + key;
        std::replace(name.begin(), name.end(), '_', ' ');
        if (value.is_object() && depth < kMaxDepth) {
            append_rows(html, value, prefix + key + " ", depth + 1);
        } else if (value.is_array()) {
            std::string items;
            for (std::size_t i = 0; i < value.size() && i < 20; ++i)
                items += fmt::format("{}{}", i ? " " : "", text_of(value[i]));
            if (value.size() > 20) items += fmt::format(" ... ({} in all)", value.size());
            html += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escape_html(name), items);
        } else {
            html += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escape_html(name), text_of(value));
        }
    }
}

std::string table_html(const char* title, const json& object) {
    if (!object.is_object() || object.empty()) return {};
    std::string html = fmt::format("<div><h2>{}</h2>\n<table>", title);
    append_rows(html, object, "", 0);
    return html + "</table></div>\n";
}

std::string notes_html(const json& notes) {
    if (!notes.is_array() || notes.empty()) return {};
    std::string html = "<h2>Notes</h2>\n<ul>";
    for (const json& note : notes) html += fmt::format("<li>{}</li>\n", text_of(note));
    return html + "</ul>\n";
}

std::string base64(const std::string& bytes) {
    static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

std::string pictures_html(const std::vector<ReportPicture>& pictures) {
    if (pictures.empty()) return {};
    std::string html = "<h2>Pictures</h2>\n<div class=\"row\">\n";
    for (const ReportPicture& picture : pictures)
        html += "<figure><img alt=\"" + escape_html(picture.title) + "\" src=\"data:image/png;base64," +
                base64(picture.png) + "\"><figcaption>" + escape_html(picture.title) +
                "</figcaption></figure>\n";
    return html + "</div>\n";
}

std::string heading_html(const json& report, const Measured& last) {
    const json &input = part_of(report, "/input"), &file = part_of(report, "/file");
    const json& output = part_of(report, "/output");
    const bool is_valid = part_of(*last.quality, "/validity/is_valid") == json(true);
    std::string html = "<h1>" + text_of(input.is_string() ? input : file);
    if (output.is_string() && !output.get_ref<const std::string&>().empty())
        html += " &rarr; " + text_of(output);
    html += fmt::format("</h1>\n<p><span class=\"{}\">{}</span>", is_valid ? "ok" : "bad",
                        is_valid ? "Every cell is valid" : "Not every cell is valid");
    if (report.contains("verdict")) html += " &middot; verdict: " + text_of(report["verdict"]);
    if (report.contains("version")) html += " &middot; hexopt-gpu " + text_of(report["version"]);
    return html + "</p>\n";
}

} // namespace

Result<std::string> make_html_report(const json& report, const std::vector<ReportPicture>& pictures) {
    const std::vector<Measured> meshes =
        report.is_object() ? measured_meshes(report) : std::vector<Measured>();
    if (meshes.empty())
        return make_error(ErrorCode::bad_input, "report", "",
                          "holds no quality: expected what 'mesh --report', 'optimize --report' or 'quality "
                          "--json' writes");
    std::string html =
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
        "<meta name=\"viewport\" content=\"width=device-width\"><title>Mesh quality</title>\n<style>";
    html += kStyle + std::string("</style></head><body>\n") + heading_html(report, meshes.back());
    html += summary_html(meshes) + notes_html(part_of(report, "/notes"));
    html += "<h2>Distributions</h2>\n<div class=\"row\">\n";
    html += histogram_html(meshes, "Scaled Jacobian: cells", "/scaled_jacobian/histogram");
    html += histogram_html(meshes, "Least dihedral angle of each cell, degrees: cells",
                           "/dihedral_deg/min_of_cell_histogram");
    html += histogram_html(meshes, "All dihedral angles, degrees: angles", "/dihedral_deg/histogram");
    html += "</div>\n" + pictures_html(pictures);
    std::string worst;
    for (const Measured& mesh : meshes) worst += worst_html(mesh);
    if (!worst.empty()) html += "<h2>Worst cells</h2>\n<div class=\"row\">\n" + worst + "</div>\n";
    html += stages_html(part_of(report, "/stages"));
    html += "<div class=\"row\">\n" + table_html("Optimizer", part_of(report, "/optimizer")) +
            table_html("Distance from the surface", part_of(report, "/deviation")) +
            table_html("Options", part_of(report, "/options")) + "</div>\n";
    return html + "</body></html>\n";
}

} // namespace hexopt
