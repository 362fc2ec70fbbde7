#include "io/gmsh_nodes.hpp"
#include "io/mesh_builder.hpp"
#include "io/readers.hpp"
#include "io/scalar.hpp"
#include "io/scanner.hpp"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <unordered_map>

namespace hexopt::io_detail {

namespace {

constexpr const char* kDamaged = "the file is damaged or cut short; write or copy it again";

struct ElementType {
    int type;
    int vertices;
    bool has_volume;
    const char* name;
};

constexpr int kQuad = 3, kHexahedron = 5;
constexpr ElementType kElementTypes[] = {
    {1, 2, false, "line"},
    {2, 3, false, "triangle"},
    {kQuad, 4, false, "quadrilateral"},
    {4, 4, true, "tetrahedron"},
    {kHexahedron, 8, true, "hexahedron"},
    {6, 6, true, "prism"},
    {7, 5, true, "pyramid"},
    {8, 3, false, "quadratic line"},
    {9, 6, false, "quadratic triangle"},
    {10, 9, false, "quadratic quadrilateral"},
    {11, 10, true, "quadratic tetrahedron"},
    {12, 27, true, "quadratic hexahedron"},
    {13, 18, true, "quadratic prism"},
    {14, 14, true, "quadratic pyramid"},
    {15, 1, false, "point"},
    {16, 8, false, "quadratic quadrilateral"},
    {17, 20, true, "quadratic hexahedron"},
    {18, 15, true, "quadratic prism"},
    {19, 13, true, "quadratic pyramid"},
    {20, 9, false, "cubic triangle"},
    {21, 10, false, "cubic triangle"},
    {26, 4, false, "cubic line"},
    {29, 20, true, "cubic tetrahedron"},
    {36, 16, false, "cubic quadrilateral"},
    {92, 64, true, "cubic hexahedron"},
    {93, 125, true, "quartic hexahedron"},
};

/// Entities of dimension 0..3 by tag, and groups of them.
using TagKey = std::pair<int, std::int64_t>;

class GmshReader {
  public:
    GmshReader(const std::string& file, std::string_view bytes, Context& context)
        : scanner_(file, bytes), builder_(file), context_(context) {}

    Result<MeshFile> read();

  private:
    bool read_format();
    bool read_section(std::string_view name, std::size_t begin);
    bool read_physical_names();
    bool read_entities();
    bool read_nodes();
    bool read_nodes_2();
    bool read_nodes_4();
    bool read_elements();
    bool read_elements_2_text();
    bool read_elements_2_binary();
    bool read_elements_4();
    bool read_vertices(int count);
    bool add_element(const ElementType& type, std::int64_t physical, std::int64_t entity);
    const ElementType* find_type(std::int64_t type);
    std::string patch_name(std::int64_t physical, std::int64_t entity) const;
    bool skip_section(std::string_view name, std::size_t begin);

    bool read_number(std::int64_t& value, Scalar scalar);
    bool read_tag(std::int64_t& value) { return read_number(value, Scalar::int32); }
    bool read_size(std::int64_t& value) { return read_number(value, Scalar::uint64); }
    bool read_real(double& value);
    /// A count stored as size_t of things that take at least text_bytes in text, binary_bytes in binary.
    bool read_size_count(std::size_t& count, const char* things, std::size_t text_bytes,
                         std::size_t binary_bytes);
    bool end_line();
    bool fail(std::string reason) { return scanner_.fail(std::move(reason), kDamaged); }

    Scanner scanner_;
    MeshBuilder builder_;
    Context& context_;
    bool is_binary_ = false, is_version_4_ = false, has_nodes_ = false, has_elements_ = false;
    std::endian order_ = std::endian::native;
    std::unordered_map<std::int64_t, std::string> names_[4]; ///< of physical groups, by dimension
    std::unordered_map<std::int64_t, std::int64_t>
        physical_of_[4]; ///< first group of an entity, by dimension
    GmshNodes nodes_;
    std::array<Index, 125> vertices_{};
    std::vector<double> cell_physical_;
    std::vector<std::size_t> cell_position_; ///< where each hexahedron stands in the file
};

bool GmshReader::read_number(std::int64_t& value, Scalar scalar) {
    if (!is_binary_) return scanner_.read_int(value);
    const std::string_view raw = scanner_.raw(size_of(scalar));
    for_each_scalar(scalar, raw, order_,
                    [&](std::size_t, auto number) { value = static_cast<std::int64_t>(number); });
    return scanner_.ok();
}

bool GmshReader::read_real(double& value) {
    if (!is_binary_) return scanner_.read_double(value);
    const std::string_view raw = scanner_.raw(sizeof(double));
    if (scanner_.ok()) value = load<double>(raw.data(), order_);
    return scanner_.ok();
}

bool GmshReader::read_size_count(std::size_t& count, const char* things, std::size_t text_bytes,
                                 std::size_t binary_bytes) {
    std::int64_t value = 0;
    if (!read_size(value)) return false;
    if (value < 0) return fail(fmt::format("a count of {} {}", value, things));
    count = static_cast<std::size_t>(value);
    return scanner_.check_count(count, things, is_binary_ ? binary_bytes : text_bytes);
}

bool GmshReader::end_line() {
    if (is_binary_) scanner_.line();
    return scanner_.ok();
}

bool GmshReader::read_format() {
    scanner_.token(); // $MeshFormat
    const std::string_view version = scanner_.token();
    std::int64_t is_binary = 0, data_size = 0;
    if (!scanner_.read_int(is_binary) || !scanner_.read_int(data_size)) return false;
    is_version_4_ = version == "4.1";
    if (!is_version_4_ && version != "2.2" && version != "2.1" && version != "2")
        return scanner_.fail(fmt::format("version {} of Gmsh's format", shown(version)),
                             "save it as version 4.1 or 2.2");
    if (data_size != 8) return fail(fmt::format("numbers of {} bytes", data_size));
    scanner_.line();
    if (is_binary != 0) {
        is_binary_ = true;
        scanner_.set_binary();
        const std::string_view one = scanner_.raw(4);
        if (!scanner_.ok()) return false;
        order_ =
            load<std::int32_t>(one.data(), std::endian::little) == 1 ? std::endian::little : std::endian::big;
        if (load<std::int32_t>(one.data(), order_) != 1) return fail("the byte order is not told");
    }
    if (scanner_.token() != "$EndMeshFormat") return fail("no $EndMeshFormat");
    return true;
}

bool GmshReader::read_physical_names() {
    std::size_t count = 0;
    if (!scanner_.read_count(count, "physical names", 6)) return false;
    scanner_.line();
    for (std::size_t i = 0; i < count; ++i) {
        Scanner line(scanner_.file(), scanner_.line());
        std::int64_t dimension = 0, tag = 0;
        if (!line.read_int(dimension) || !line.read_int(tag) || dimension < 0 || dimension > 3)
            return fail("a physical name without dimension and number");
        const std::string_view rest = line.bytes().substr(line.position());
        const std::size_t begin = rest.find('"'), end = rest.rfind('"');
        if (begin == end) return fail("a physical name without quotes");
        names_[dimension][tag] = std::string(rest.substr(begin + 1, end - begin - 1));
    }
    return true;
}

/// Only which physical groups an entity belongs to is of interest.
bool GmshReader::read_entities() {
    if (!is_version_4_) return fail("$Entities in a file of version 2");
    std::array<std::size_t, 4> counts{};
    for (std::size_t& count : counts)
        if (!read_size_count(count, "entities", 4, 12)) return false;
    for (int dimension = 0; dimension < 4; ++dimension)
        for (std::size_t i = 0; i < counts[static_cast<std::size_t>(dimension)]; ++i) {
            std::int64_t tag = 0, number = 0;
            double ignored = 0;
            std::size_t count = 0;
            if (!read_tag(tag)) return false;
            for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k)
                if (!read_real(ignored)) return false;
            if (!read_size_count(count, "groups", 2, 4)) return false;
            for (std::size_t k = 0; k < count; ++k) {
                if (!read_tag(number)) return false;
                if (k == 0) physical_of_[dimension][tag] = number;
            }
            if (dimension == 0) continue;
            if (!read_size_count(count, "bounding entities", 2, 4)) return false;
            for (std::size_t k = 0; k < count; ++k)
                if (!read_tag(number)) return false;
        }
    return true;
}

bool GmshReader::read_nodes() {
    if (std::exchange(has_nodes_, true)) return fail("a second list of nodes");
    if (!(is_version_4_ ? read_nodes_4() : read_nodes_2())) return false;
    if (const std::optional<std::int64_t> twice = nodes_.index())
        return fail(fmt::format("node {} stands twice", *twice));
    return true;
}

bool GmshReader::read_nodes_2() {
    std::size_t count = 0;
    if (!scanner_.read_count(count, "nodes", is_binary_ ? 28 : 8) || !end_line()) return false;
    builder_.mesh.positions.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        std::int64_t tag = 0;
        Point p;
        if (!read_tag(tag) || !read_real(p.x) || !read_real(p.y) || !read_real(p.z)) return false;
        nodes_.add(tag);
        builder_.mesh.positions.push_back(p);
    }
    return true;
}

bool GmshReader::read_nodes_4() {
    std::size_t block_count = 0, count = 0;
    std::int64_t ignored = 0;
    if (!read_size_count(block_count, "blocks of nodes", 8, 20) || !read_size_count(count, "nodes", 8, 32) ||
        !read_size(ignored) || !read_size(ignored))
        return false;
    for (std::size_t b = 0; b < block_count; ++b) {
        std::int64_t dimension = 0, entity = 0, is_parametric = 0;
        std::size_t size = 0;
        if (!read_tag(dimension) || !read_tag(entity) || !read_tag(is_parametric) ||
            !read_size_count(size, "nodes", 8, 32))
            return false;
        if (dimension < 0 || dimension > 3) return fail(fmt::format("an entity of dimension {}", dimension));
        for (std::size_t i = 0; i < size; ++i) {
            std::int64_t tag = 0;
            if (!read_size(tag)) return false;
            nodes_.add(tag);
        }
        for (std::size_t i = 0; i < size; ++i) {
            Point p;
            double parameter = 0;
            if (!read_real(p.x) || !read_real(p.y) || !read_real(p.z)) return false;
            for (std::int64_t k = 0; is_parametric != 0 && k < dimension; ++k)
                if (!read_real(parameter)) return false;
            builder_.mesh.positions.push_back(p);
        }
    }
    if (builder_.mesh.positions.size() != count)
        return fail(fmt::format("{} nodes where {} are announced", builder_.mesh.positions.size(), count));
    return true;
}

const ElementType* GmshReader::find_type(std::int64_t type) {
    const auto found = std::find_if(std::begin(kElementTypes), std::end(kElementTypes),
                                    [&](const ElementType& t) { return t.type == type; });
    if (found != std::end(kElementTypes)) return &*found;
    scanner_.fail(fmt::format("elements of Gmsh's type {}", type),
                  "only linear hexahedra and what bounds them are supported");
    return nullptr;
}

std::string GmshReader::patch_name(std::int64_t physical, std::int64_t entity) const {
    if (physical == 0) return fmt::format("surface_{}", entity);
    const auto name = names_[2].find(physical);
    return name != names_[2].end() && !name->second.empty() ? name->second
                                                            : fmt::format("physical_{}", physical);
}

bool GmshReader::read_vertices(int count) {
    for (int i = 0; i < count; ++i) {
        std::int64_t tag = 0;
        if (!(is_version_4_ ? read_size(tag) : read_tag(tag))) return false;
        const std::optional<Index> vertex = nodes_.find(tag);
        if (!vertex) return fail(fmt::format("an element uses node {}, which the file does not list", tag));
        vertices_[static_cast<std::size_t>(i)] = *vertex;
    }
    return true;
}

bool GmshReader::add_element(const ElementType& type, std::int64_t physical, std::int64_t entity) {
    const auto& v = vertices_;
    if (type.type == kHexahedron) {
        const Cell cell = {v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7]};
        // Version 2 lists an element of several groups once for each, one after the other.
        if (!is_version_4_ && !builder_.mesh.cells.empty() && builder_.mesh.cells.back() == cell) return true;
        builder_.mesh.cells.push_back(cell);
        cell_physical_.push_back(static_cast<double>(physical));
        cell_position_.push_back(scanner_.position());
    } else if (type.type == kQuad) {
        const Quad quad = {v[0], v[1], v[2], v[3]};
        if (!is_version_4_ && !builder_.quads.empty() && builder_.quads.back().vertices == quad) return true;
        builder_.quads.push_back({quad, builder_.patch_of(patch_name(physical, entity))});
    } else {
        ++(type.has_volume ? builder_.unsupported : builder_.ignored)[type.name];
    }
    return true;
}

bool GmshReader::read_elements() {
    if (!has_nodes_) return fail("elements before nodes");
    if (std::exchange(has_elements_, true)) return fail("a second list of elements");
    return is_version_4_ ? read_elements_4() : is_binary_ ? read_elements_2_binary() : read_elements_2_text();
}

bool GmshReader::read_elements_2_text() {
    std::size_t count = 0;
    if (!scanner_.read_count(count, "elements", 8)) return false;
    for (std::size_t i = 0; i < count; ++i) {
        std::int64_t number = 0, type = 0, tag_count = 0, physical = 0, entity = 0;
        if (!read_tag(number) || !read_tag(type) || !read_tag(tag_count)) return false;
        const ElementType* known = find_type(type);
        if (known == nullptr) return false;
        for (std::int64_t k = 0; k < tag_count; ++k) {
            std::int64_t tag = 0;
            if (!read_tag(tag)) return false;
            if (k == 0) physical = tag;
            if (k == 1) entity = tag;
        }
        if (!read_vertices(known->vertices) || !add_element(*known, physical, entity)) return false;
    }
    return true;
}

bool GmshReader::read_elements_2_binary() {
    std::size_t count = 0;
    if (!scanner_.read_count(count, "elements", 8) || !end_line()) return false;
    for (std::size_t done = 0; done < count;) {
        std::int64_t type = 0, size = 0, tag_count = 0;
        if (!read_tag(type) || !read_tag(size) || !read_tag(tag_count)) return false;
        const ElementType* known = find_type(type);
        if (known == nullptr) return false;
        if (size <= 0 || static_cast<std::size_t>(size) > count - done || tag_count < 0)
            return fail(fmt::format("a block of {} elements with {} tags", size, tag_count));
        for (std::int64_t i = 0; i < size; ++i) {
            std::int64_t number = 0, physical = 0, entity = 0, tag = 0;
            if (!read_tag(number)) return false;
            for (std::int64_t k = 0; k < tag_count; ++k) {
                if (!read_tag(tag)) return false;
                if (k == 0) physical = tag;
                if (k == 1) entity = tag;
            }
            if (!read_vertices(known->vertices) || !add_element(*known, physical, entity)) return false;
        }
        done += static_cast<std::size_t>(size);
    }
    return true;
}

bool GmshReader::read_elements_4() {
    std::size_t block_count = 0, count = 0, done = 0;
    std::int64_t ignored = 0;
    if (!read_size_count(block_count, "blocks of elements", 8, 20) ||
        !read_size_count(count, "elements", 4, 16) || !read_size(ignored) || !read_size(ignored))
        return false;
    for (std::size_t b = 0; b < block_count; ++b) {
        std::int64_t dimension = 0, entity = 0, type = 0, number = 0;
        std::size_t size = 0;
        if (!read_tag(dimension) || !read_tag(entity) || !read_tag(type) ||
            !read_size_count(size, "elements", 4, 16))
            return false;
        const ElementType* known = find_type(type);
        if (known == nullptr) return false;
        if (dimension < 0 || dimension > 3) return fail(fmt::format("an entity of dimension {}", dimension));
        const auto group = physical_of_[dimension].find(entity);
        const std::int64_t physical = group == physical_of_[dimension].end() ? 0 : group->second;
        for (std::size_t i = 0; i < size; ++i)
            if (!read_size(number) || !read_vertices(known->vertices) ||
                !add_element(*known, physical, entity))
                return false;
        done += size;
    }
    if (done != count) return fail(fmt::format("{} elements where {} are announced", done, count));
    return true;
}

bool GmshReader::skip_section(std::string_view name, std::size_t begin) {
    const std::string end = fmt::format("$End{}", name);
    const std::size_t position = scanner_.bytes().find(end, scanner_.position());
    if (position == std::string_view::npos)
        return scanner_.fail_at(begin, fmt::format("section {} does not end", shown(name)), kDamaged);
    scanner_.seek(position);
    return true;
}

bool GmshReader::read_section(std::string_view name, std::size_t begin) {
    if (name == "PhysicalNames" || name == "Entities" || name == "Nodes" || name == "Elements") {
        if (!(name == "PhysicalNames" && is_binary_)) end_line();
        if (name == "PhysicalNames" && !read_physical_names()) return false;
        if (name == "Entities" && !read_entities()) return false;
        if (name == "Nodes" && !read_nodes()) return false;
        if (name == "Elements" && !read_elements()) return false;
    } else if (!skip_section(name, begin)) {
        return false;
    }
    const std::string_view end = scanner_.token();
    if (end == fmt::format("$End{}", name)) return true;
    return scanner_.ok() && fail(fmt::format("'{}' stands where $End{} should", shown(end), shown(name)));
}

Result<MeshFile> GmshReader::read() {
    if (!read_format()) return scanner_.error();
    while (!scanner_.at_end()) {
        const std::size_t begin = scanner_.position();
        const std::string_view word = scanner_.token();
        if (!word.starts_with('$'))
            scanner_.fail_at(begin, fmt::format("'{}' stands where a section should start", shown(word)),
                             kDamaged);
        else
            read_section(word.substr(1), begin);
        if (!scanner_.ok()) return scanner_.error();
    }
    if (!has_nodes_ || !has_elements_) {
        scanner_.fail_at(scanner_.position(),
                         fmt::format("the file ends without ${}", has_nodes_ ? "Elements" : "Nodes"),
                         kDamaged);
        return scanner_.error();
    }
    if (std::any_of(cell_physical_.begin(), cell_physical_.end(), [](double tag) { return tag != 0; }))
        builder_.fields.push_back(
            {"gmsh:physical", FieldLocation::cell, 1, std::move(cell_physical_), FieldType::int64});
    return builder_.finish(
        [&](std::size_t vertex) { return fmt::format("{}: node {}", scanner_.file(), nodes_.tag(vertex)); },
        [&](std::size_t cell) { return scanner_.place(cell_position_[cell] - 1); }, context_);
}

} // namespace

bool looks_like_gmsh(std::string_view bytes) {
    return Scanner("", bytes.substr(0, 4096)).token() == "$MeshFormat";
}

Result<MeshFile> read_gmsh(const std::string& file, std::string_view bytes, Context& context) {
    return GmshReader(file, bytes, context).read();
}

} // namespace hexopt::io_detail
