#include "io/surface_readers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

namespace hexopt::io_detail {

namespace {

constexpr std::string_view kSkipped[] = {"vn", "vt", "vp",     "s",      "mtllib",
                                         "l",  "p",  "usemap", "maplib", "lod"};

class ObjReader {
  public:
    ObjReader(Scanner& scanner, SurfaceBuilder& builder) : scanner_(scanner), builder_(builder) {}
    bool read();

  private:
    bool read_statement(std::string_view word, std::string_view rest, std::size_t begin);
    bool read_vertex(std::string_view rest, std::size_t begin);
    bool read_face(std::string_view rest, std::size_t begin);
    void finish_patches();

    Scanner& scanner_;
    SurfaceBuilder& builder_;
    std::vector<Index> ids_;
    std::string joined_;
    std::string group_, material_;
    std::vector<std::string> material_names_;
    std::vector<Index> materials_; ///< per triangle
    bool has_groups_ = false;
    std::size_t unknown_ = 0, first_unknown_ = 0, small_ = 0;
};

std::string_view trimmed(std::string_view text) {
    const std::size_t begin = text.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

bool ObjReader::read_vertex(std::string_view rest, std::size_t begin) {
    Scanner numbers(scanner_.file(), rest);
    Point p;
    for (int k = 0; k < 3; ++k)
        if (!numbers.read_double(p[k]))
            return scanner_.fail_at(begin, "a vertex without three numbers", "the file is damaged");
    if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)))
        return scanner_.fail_at(begin, "a coordinate that is not finite", "give finite coordinates");
    builder_.soup.vertices.push_back(p);
    return true;
}

/// Entries are v, v/vt, v//vn or v/vt/vn; v counts from 1, or backwards from the last vertex where it is
/// negative.
bool ObjReader::read_face(std::string_view rest, std::size_t begin) {
    ids_.clear();
    Scanner entries("", rest);
    for (std::string_view entry = entries.token(); !entry.empty(); entry = entries.token()) {
        Scanner number("", entry.substr(0, entry.find('/')));
        std::int64_t id = 0;
        if (!number.read_int(id))
            return scanner_.fail_at(begin, fmt::format("face entry '{}'", shown(entry)),
                                    "the file is damaged");
        const auto count = static_cast<std::int64_t>(builder_.soup.vertices.size());
        const std::int64_t from_zero = id < 0 ? count + id : id - 1;
        if (id == 0 || from_zero < 0 || from_zero >= kNoIndex)
            return scanner_.fail_at(begin, fmt::format("vertex id {} after {} vertices", id, count),
                                    "ids start at 1 (or -1 for the last vertex)");
        ids_.push_back(static_cast<Index>(from_zero));
    }
    if (ids_.size() < 3) return ++small_, true;
    builder_.patch = builder_.patch_of(group_);
    if (material_names_.empty() || material_names_.back() != material_) material_names_.push_back(material_);
    builder_.add_polygon(ids_);
    materials_.resize(builder_.soup.triangles.size(), static_cast<Index>(material_names_.size() - 1));
    return true;
}

bool ObjReader::read_statement(std::string_view word, std::string_view rest, std::size_t begin) {
    if (word == "v") return read_vertex(rest, begin);
    if (word == "f" || word == "fo") return read_face(rest, begin);
    if (word == "g" || word == "o") {
        group_ = std::string(trimmed(rest));
        has_groups_ = true;
    } else if (word == "usemtl") {
        material_ = std::string(trimmed(rest));
    } else if (std::find(std::begin(kSkipped), std::end(kSkipped), word) == std::end(kSkipped)) {
        if (unknown_++ == 0) first_unknown_ = begin;
    }
    return true;
}

/// Without groups or objects, the materials are the patches.
void ObjReader::finish_patches() {
    if (has_groups_) return;
    builder_.soup.patch_names.clear();
    SurfaceBuilder named(builder_.context);
    for (std::size_t t = 0; t < materials_.size(); ++t)
        builder_.soup.patch[t] = named.patch_of(material_names_[materials_[t]]);
    builder_.soup.patch_names = std::move(named.soup.patch_names);
}

bool ObjReader::read() {
    while (scanner_.ok() && scanner_.remaining() > 0) {
        const std::size_t begin = scanner_.position();
        std::string_view line = scanner_.line();
        if (line.ends_with('\\')) {
            joined_.clear();
            for (; line.ends_with('\\'); line = scanner_.line())
                joined_.append(line.substr(0, line.size() - 1)).append(" ");
            joined_.append(line);
            line = joined_;
        }
        line = trimmed(line.substr(0, line.find('#')));
        const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
        if (end > 0 && !read_statement(line.substr(0, end), line.substr(end), begin)) return false;
    }
    if (unknown_ > 0)
        builder_.context.log(LogLevel::warning,
                             fmt::format("{}: {} lines that are not understood are left out",
                                         scanner_.place(first_unknown_), unknown_));
    if (small_ > 0)
        builder_.context.log(
            LogLevel::warning,
            fmt::format("{}: {} faces of fewer than three vertices are left out", scanner_.file(), small_));
    finish_patches();
    return scanner_.ok();
}

} // namespace

bool looks_like_obj(std::string_view bytes) {
    Scanner scanner("", bytes.substr(0, 65536));
    while (scanner.remaining() > 0) {
        const std::string_view line = trimmed(scanner.line());
        if (line.empty() || line.starts_with('#')) continue;
        for (std::string_view word : {"v ", "v\t", "mtllib ", "o ", "g ", "vn ", "vt ", "usemtl "})
            if (line.starts_with(word)) return true;
        return line == "g" || line == "o";
    }
    return false;
}

bool read_obj(Scanner& scanner, SurfaceBuilder& builder) { return ObjReader(scanner, builder).read(); }

} // namespace hexopt::io_detail
