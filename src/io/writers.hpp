#pragma once

#include "io/atomic_file.hpp"
#include "io/mesh_io.hpp"

#include <bit>

/// One writer a format. Each writes everything into a file that write_mesh() has opened and will commit.
namespace hexopt::io_detail {

/// A mesh and its arrays, checked and ready to be written.
struct MeshToWrite {
    const HexMesh& mesh;
    std::vector<const FieldData*> point, cell; ///< arrays on vertices and cells, without repeated names
    std::vector<FieldData> field;              ///< hanging constraints and boundary quads
    FieldData level;                           ///< values empty where the mesh has no levels
};

Status write_vtu(AtomicFile& file, const MeshToWrite& content, const WriteOptions& options, Context& context);
Status write_legacy_vtk(AtomicFile& file, const MeshToWrite& content, bool is_binary);
Status write_medit(AtomicFile& file, const MeshToWrite& content);

/// The values of an array in its own type and the given byte order.
std::string encode(const FieldData& field, std::endian order);

/// The same for one number.
template <class T>
void append_number(std::string& bytes, T value, std::endian order) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (order != std::endian::native) std::reverse(raw.begin(), raw.end());
    bytes.append(raw.data(), raw.size());
}

/// Collects text and passes it on in large pieces; the first failure sticks.
class TextWriter {
  public:
    explicit TextWriter(AtomicFile& file) : file_(file) {}
    void text(std::string_view bytes);
    /// Shortest digits that read back to the same bits.
    void number(double value);
    void number(float value);
    void number(std::int64_t value);
    /// The values of an array, one tuple a line.
    void array(const FieldData& field);
    Status finish();

  private:
    template <class T>
    void put(T value);

    AtomicFile& file_;
    std::string buffer_;
    Status status_ = Done{};
};

} // namespace hexopt::io_detail
