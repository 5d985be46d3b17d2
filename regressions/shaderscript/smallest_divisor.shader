divisor
{
	deformVertexes wave 1e-45 sin 1 1 0 1
	{
		map a
	}
}
