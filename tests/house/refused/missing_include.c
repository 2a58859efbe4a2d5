/* Must be refused: uint32_t without its header. */
uint32_t sample;
