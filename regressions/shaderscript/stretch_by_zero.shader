zero
{
	{
		map a
		tcMod stretch sin 0 0 0 0
	}
}
