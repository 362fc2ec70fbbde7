#include "unused_pages.hpp"

#include <cstdint>
#include <link.h>
#include <span>
#include <sys/mman.h>
#include <unistd.h>

namespace hexopt::cli {

namespace {

bool has_text_relocations(const dl_phdr_info& info) {
    for (const ElfW(Phdr) & header : std::span(info.dlpi_phdr, info.dlpi_phnum)) {
        if (header.p_type != PT_DYNAMIC) continue;
        const auto* entry = reinterpret_cast<const ElfW(Dyn)*>(info.dlpi_addr + header.p_vaddr);
        for (; entry->d_tag != DT_NULL; ++entry)
            if (entry->d_tag == DT_TEXTREL || (entry->d_tag == DT_FLAGS && entry->d_un.d_val & DF_TEXTREL))
                return true;
    }
    return false;
}

/// Segments that are not written to hold nothing but what is in the file.
int release_library(dl_phdr_info* info, std::size_t, void* page_size) {
    const auto page = *static_cast<const std::uintptr_t*>(page_size);
    if (!info->dlpi_name || info->dlpi_name[0] != '/' || has_text_relocations(*info)) return 0;
    for (const ElfW(Phdr) & header : std::span(info->dlpi_phdr, info->dlpi_phnum)) {
        if (header.p_type != PT_LOAD || (header.p_flags & PF_W) != 0) continue;
        const std::uintptr_t begin = (info->dlpi_addr + header.p_vaddr + page - 1) / page * page;
        const std::uintptr_t end = (info->dlpi_addr + header.p_vaddr + header.p_filesz) / page * page;
        if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
    }
    return 0;
}

} // namespace

void release_loaded_pages() {
    auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    dl_iterate_phdr(release_library, &page);
}

} // namespace hexopt::cli
