#include "io/scalar.hpp"
#include "io/writers.hpp"

#include <charconv>

namespace hexopt::io_detail {

template <class T>
void TextWriter::put(T value) {
    char digits[32];
    const auto [end, code] = std::to_chars(digits, digits + sizeof digits, value);
    text({digits, static_cast<std::size_t>(end - digits)});
}

void TextWriter::text(std::string_view bytes) {
    constexpr std::size_t kLarge = std::size_t{1} << 16;
    buffer_.append(bytes);
    if (buffer_.size() < kLarge) return;
    if (status_) status_ = file_.write(buffer_);
    buffer_.clear();
}

void TextWriter::number(double value) { put(value); }
void TextWriter::number(float value) { put(value); }
void TextWriter::number(std::int64_t value) { put(value); }

void TextWriter::array(const FieldData& field) {
    for (std::size_t i = 0; i < field.values.size(); ++i) {
        if (is_integer(field.type))
            number(static_cast<std::int64_t>(field.values[i]));
        else if (field.type == FieldType::float32)
            number(static_cast<float>(field.values[i]));
        else
            number(field.values[i]);
        text((i + 1) % field.components == 0 ? "\n" : " ");
    }
}

Status TextWriter::finish() {
    if (status_ && !buffer_.empty()) status_ = file_.write(buffer_);
    buffer_.clear();
    return status_;
}

} // namespace hexopt::io_detail
