#pragma once

#include <cstdint>
#include <string_view>

namespace hexopt {

/// 64-bit FNV-1a of bytes: tells accidental changes, no deliberate ones.
class Digest {
  public:
    Digest& add(std::string_view bytes) {
        for (const char c : bytes) value_ = (value_ ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
        return *this;
    }
    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = 0xcbf29ce484222325ull;
};

} // namespace hexopt
