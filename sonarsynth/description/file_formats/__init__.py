"""Files of formats that several kinds of input are written in, as those who do not trust them read them."""
