#include "io/surface_readers.hpp"
#include "io/vtk_xml.hpp"

#include <array>

namespace hexopt::io_detail {

namespace {

class VtpReader : VtkXmlReader {
  public:
    VtpReader(const std::string& file, std::string_view bytes, SurfaceBuilder& builder)
        : VtkXmlReader(file, bytes, "PolyData"), builder_(builder) {}

    bool read() {
        if (!read_tags()) return false;
        for (std::size_t piece = 0; piece < pieces_.size(); ++piece)
            if (!read_piece(piece)) return false;
        return true;
    }
    const Error& error() const { return scanner_.error(); }

  private:
    bool read_piece(std::size_t piece);
    bool read_patches(std::size_t piece, std::vector<std::int64_t>& patches);
    bool add_polygons(std::size_t piece, const std::vector<std::int64_t>& patches);
    bool add_strips(std::size_t piece, const std::vector<std::int64_t>& patches);
    void choose_patch(const std::vector<std::int64_t>& patches, std::size_t cell) {
        builder_.patch = builder_.patch_of(cell < patches.size() ? "patch_" + std::to_string(patches[cell])
                                                                 : std::string("surface"));
    }

    SurfaceBuilder& builder_;
    Index first_ = 0; ///< number of the piece's first vertex
};

/// The first whole-number array of cells that is known to name patches; empty where there is none.
bool VtpReader::read_patches(std::size_t piece, std::vector<std::int64_t>& patches) {
    const XmlPiece& p = pieces_[piece];
    for (const char* name : {"patch", "gmsh:physical", "medit:ref", "CellEntityIds"}) {
        const XmlArray* array = find_array(XmlSection::cell_data, piece, name);
        if (array == nullptr || array->components != 1 || !is_integer(array->scalar)) continue;
        const auto use = [&](std::size_t, auto value) {
            patches.push_back(static_cast<std::int64_t>(value));
        };
        return for_each_value(*array, p.verts + p.lines + p.polys + p.strips, use);
    }
    return true;
}

bool VtpReader::add_polygons(std::size_t piece, const std::vector<std::int64_t>& patches) {
    const XmlPiece& p = pieces_[piece];
    if (p.polys == 0) return true;
    std::vector<std::int64_t> ends, ids;
    if (!read_rows(XmlSection::polys, piece, p.polys, ends, ids)) return false;
    std::vector<Index> polygon;
    for (std::size_t i = 0; i < p.polys; ++i) {
        polygon.clear();
        for (auto k = static_cast<std::size_t>(ends[i]); k < static_cast<std::size_t>(ends[i + 1]); ++k)
            polygon.push_back(first_ + static_cast<Index>(ids[k]));
        choose_patch(patches, p.verts + p.lines + i);
        builder_.add_polygon(polygon);
    }
    return true;
}

/// Every second triangle of a strip runs the other way round.
bool VtpReader::add_strips(std::size_t piece, const std::vector<std::int64_t>& patches) {
    const XmlPiece& p = pieces_[piece];
    if (p.strips == 0) return true;
    std::vector<std::int64_t> ends, ids;
    if (!read_rows(XmlSection::strips, piece, p.strips, ends, ids)) return false;
    for (std::size_t i = 0; i < p.strips; ++i) {
        choose_patch(patches, p.verts + p.lines + p.polys + i);
        const auto begin = static_cast<std::size_t>(ends[i]), end = static_cast<std::size_t>(ends[i + 1]);
        for (std::size_t k = begin; k + 2 < end; ++k) {
            std::array<Index, 3> t;
            for (std::size_t j = 0; j < 3; ++j) t[j] = first_ + static_cast<Index>(ids[k + j]);
            if ((k - begin) % 2 == 1) std::swap(t[1], t[2]);
            builder_.add_polygon(t);
        }
    }
    return true;
}

bool VtpReader::read_piece(std::size_t piece) {
    std::vector<Point> positions;
    std::vector<std::int64_t> patches;
    if (!read_points(piece, positions) || !read_patches(piece, patches)) return false;
    first_ = static_cast<Index>(builder_.soup.vertices.size());
    if (positions.size() >= kNoIndex - std::size_t{first_})
        return scanner_.fail_at(pieces_[piece].begin, "more vertices than can be numbered",
                                "split the surface");
    builder_.soup.vertices.insert(builder_.soup.vertices.end(), positions.begin(), positions.end());
    if (pieces_[piece].verts + pieces_[piece].lines > 0)
        builder_.context.log(LogLevel::warning, scanner_.file() + ": points and lines are left out");
    return add_polygons(piece, patches) && add_strips(piece, patches);
}

} // namespace

bool looks_like_vtp(std::string_view bytes) {
    const std::string_view start = bytes.substr(0, 4096);
    const std::size_t tag = start.find("<VTKFile");
    if (tag == std::string_view::npos || start[start.find_first_not_of(" \t\r\n\xEF\xBB\xBF")] != '<')
        return false;
    return true;
}

bool read_vtp(Scanner& scanner, SurfaceBuilder& builder) {
    VtpReader reader(scanner.file(), scanner.bytes(), builder);
    return reader.read() || scanner.adopt(reader.error());
}

} // namespace hexopt::io_detail
