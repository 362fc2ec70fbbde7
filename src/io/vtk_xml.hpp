#pragma once

#include "core/context.hpp"
#include "core/types.hpp"
#include "io/scalar.hpp"
#include "io/scanner.hpp"
#include "io/vtu_blocks.hpp"
#include "io/xml_tags.hpp"

#include <fmt/format.h>
#include <optional>
#include <string>
#include <vector>

namespace hexopt::io_detail {

inline constexpr const char* kDamagedFile = "the file is damaged or cut short; write or copy it again";

enum class XmlSection : std::uint8_t {
    none,
    field_data,
    point_data,
    cell_data,
    points,
    cells,
    verts,
    lines,
    polys,
    strips
};
enum class XmlFormat : std::uint8_t { ascii, binary, appended };

/// A DataArray element; its data are decoded later.
struct XmlArray {
    XmlSection section = XmlSection::none;
    std::size_t piece = 0;
    std::string name;
    Scalar scalar = Scalar::float64;
    bool is_string = false;
    std::uint32_t components = 1;
    XmlFormat format = XmlFormat::ascii;
    std::size_t offset = 0;                   ///< of appended data
    std::size_t begin = 0;                    ///< position of the tag
    std::size_t text_begin = 0, text_end = 0; ///< inline data
};

struct XmlPiece {
    std::size_t begin = 0, points = 0;
    std::size_t cells = 0;                                   ///< of an UnstructuredGrid
    std::size_t verts = 0, lines = 0, polys = 0, strips = 0; ///< of a PolyData
};

/// What VTK's XML files of all kinds have in common: tags, arrays in three formats, pieces. The first failure
/// sticks in scanner_.
class VtkXmlReader {
  public:
    /// grid: the type of the file, "UnstructuredGrid" or "PolyData".
    VtkXmlReader(const std::string& file, std::string_view bytes, const char* grid)
        : scanner_(file, bytes), grid_(grid) {}

  protected:
    bool read_tags();
    const XmlArray* find_array(XmlSection section, std::size_t piece, std::string_view name) const;
    template <class Use>
    bool for_each_value(const XmlArray& array, std::optional<std::size_t> count, const Use& use);
    bool read_integers(const XmlArray& array, std::optional<std::size_t> count, std::int64_t limit,
                       std::vector<std::int64_t>& out);
    bool read_points(std::size_t piece, std::vector<Point>& positions);
    /// Vertices of cells, as rising ends of the rows in `connectivity` after a 0.
    bool read_rows(XmlSection section, std::size_t piece, std::size_t count,
                   std::vector<std::int64_t>& offsets, std::vector<std::int64_t>& connectivity);
    bool fail(const XmlArray& array, std::string reason, std::string advice = kDamagedFile) {
        return scanner_.fail_at(array.begin, fmt::format("array {}: {}", shown(array.name), reason),
                                std::move(advice));
    }

    Scanner scanner_;
    std::vector<XmlArray> arrays_;
    std::vector<XmlPiece> pieces_;

  private:
    bool read_tag(const XmlTag& tag);
    bool read_file_tag(const XmlTag& tag);
    bool read_piece_tag(const XmlTag& tag);
    bool read_array_tag(const XmlTag& tag);
    bool start_appended(const XmlTag& tag);
    bool read_number(const XmlTag& tag, const char* attribute, std::size_t& value,
                     std::optional<std::size_t> fallback = {});
    bool decode(const XmlArray& array, std::optional<std::size_t> count, std::string& content);
    std::string_view appended_slice(const XmlArray& array) const;

    std::string grid_;
    BlockLayout layout_;
    std::vector<std::size_t> offsets_; ///< of all appended arrays, rising
    XmlSection section_ = XmlSection::none;
    bool has_file_tag_ = false, has_grid_tag_ = false, is_in_piece_ = false;
    std::optional<std::size_t> appended_begin_;
    bool appended_is_raw_ = true;
    std::size_t appended_used_ = 0;
};

/// Calls use(i, value) for each number of an array, in a type that holds it: std::int64_t or double for text.
template <class Use>
bool VtkXmlReader::for_each_value(const XmlArray& array, std::optional<std::size_t> count, const Use& use) {
    if (array.format != XmlFormat::ascii) {
        std::string content;
        if (!decode(array, count, content)) return false;
        for_each_scalar(array.scalar, content, layout_.order, use);
        return true;
    }
    Scanner text(scanner_.file(), scanner_.bytes().substr(0, array.text_end));
    text.seek(array.text_begin);
    if (count && !text.check_count(*count, "numbers", 2)) return scanner_.adopt(text.error());
    // Positions keep all digits, whatever their type.
    const bool is_rounded = array.scalar == Scalar::float32 && array.section != XmlSection::points;
    std::size_t i = 0;
    for (; !text.at_end() && (!count || i < *count); ++i) {
        std::int64_t integer = 0;
        double number = 0;
        if (!(is_integer(array.scalar) ? text.read_int(integer)
              : is_rounded             ? text.read_float(number)
                                       : text.read_double(number)))
            return scanner_.adopt(text.error());
        is_integer(array.scalar) ? use(i, integer) : use(i, number);
    }
    if (count && (i < *count || !text.at_end()))
        return fail(array, fmt::format("{} numbers stand where {} are needed", i < *count ? "fewer" : "more",
                                       *count));
    return true;
}

} // namespace hexopt::io_detail
