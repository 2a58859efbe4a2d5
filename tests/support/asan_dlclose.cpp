// For address-sanitizer builds only. The Vulkan loader unloads drivers and layers before the leak
// check at exit, which then cannot name the module of a leak, so that no suppression matches.
// Keeping them loaded gives every leak its module; see lsan.supp.
extern "C" __attribute__((visibility("default"))) int dlclose(void*) {
    return 0;
}
